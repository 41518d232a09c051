#!/bin/bash
# dvc 3.67.1. Parameters are compared as Python values: `true` -> `1` and `1` -> `1.0` count as unchanged, and the stage that
# would now be given another type is not run again. Seen: "Data and pipelines are up to date." after both changes.
# Source: DVC user guide, parameters; dvc.dependency.param.
set -euo pipefail
here=$(mktemp -d)
trap 'rm -rf "$here"' EXIT
python3 -m venv "$here/venv"
"$here/venv/bin/pip" install -q dvc==3.67.1
cd "$here"
export DVC_NO_ANALYTICS=1 PATH="$here/venv/bin:$PATH"
dvc init -q --no-scm
printf 'flag: true\nnumber: 1\n' > params.yaml
cat > dvc.yaml <<'Y'
stages:
  copy:
    cmd: cat params.yaml > out
    params: [flag, number]
    outs: [out]
Y
dvc repro -q
printf 'flag: 1\nnumber: 1.0\n' > params.yaml
said=$(dvc status)
echo "dvc $(dvc --version): $said"
grep -q "up to date" <<<"$said"
printf 'flag: 2\nnumber: 1.0\n' > params.yaml  # a change that counts, so that the check above can fail
dvc status | grep -q "copy"
