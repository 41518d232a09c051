#!/bin/bash
# cyclonedds 0.10.2 (the Python binding's sdist) beside CycloneDDS 0.10.2 as Debian 12 packs it: CYCLONEDDS_HOME must be
# a folder with bin, include and lib, and lib must hold the library itself. Debian's lies in lib/<multiarch>, so the
# prefix /usr is not found; nor is a folder with the right include and lib and no bin. Three links are found.
# Seen: "Could not locate cyclonedds" twice, then a module that imports. Source: buildhelp/cyclone_search.py of the sdist.
set -euo pipefail
here=$(mktemp -d)
trap 'rm -rf "$here"' EXIT
cd "$here"
apt-get download -q $(apt-cache depends --recurse --no-recommends --no-suggests --no-conflicts --no-breaks --no-replaces --no-enhances \
  cyclonedds-dev=0.10.2-2 | grep -E '^(cyclonedds|lib(cyclonedds|ddsc))' | sort -u) >/dev/null
for package in *.deb; do dpkg -x "$package" debian; done
python3 -m venv venv
usr=$here/debian/usr lib=$here/debian/usr/lib/$(gcc -print-multiarch)
install() { CYCLONEDDS_HOME=$1 venv/bin/pip install -q --no-deps --no-cache-dir cyclonedds==0.10.2 > log 2>&1; }
mkdir two three
ln -s "$usr/include" two/include && ln -s "$lib" two/lib
cp -a two/. three && mkdir -p "$usr/bin" && ln -s "$usr/bin" three/bin
for home in "$usr" "$here/two"; do
  if install "$home"; then echo "changed: $home is found"; exit 1; fi
  grep -q "Could not locate cyclonedds" log || { tail -5 log; echo "changed: another failure"; exit 1; }
  echo "$(basename "$home"): Could not locate cyclonedds"
done
install "$here/three" || { tail -5 log; exit 1; }
LD_LIBRARY_PATH=$lib venv/bin/python -c "
import cyclonedds.domain
from importlib.metadata import version
print('bin, include and lib: cyclonedds', version('cyclonedds'), 'imports')"
