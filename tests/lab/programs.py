"""Programs that people run elsewhere: they register, look, log and run flows, with the clients of both servers."""

MODEL = """
import mlflow, sys
client, name = mlflow.MlflowClient(), sys.argv[1]
client.create_registered_model(name)
with mlflow.start_run() as run:
    mlflow.log_text("weights", "model/policy.onnx")
client.create_model_version(name, source=f"{run.info.artifact_uri}/model", run_id=run.info.run_id)
client.set_registered_model_alias(name, "champion", "1")
"""
LOOK = """
import asyncio, mlflow, sys
from prefect.client.orchestration import get_client
async def flows():
    async with get_client() as client:
        return [flow.name for flow in await client.read_flows()]
print(mlflow.MlflowClient().get_model_version_by_alias(sys.argv[1], "champion").version, asyncio.run(flows()))
"""
STAGE = """
from pathlib import Path
from tasks import registry
from tests.tasks.test_registry import policy_folder
print(registry.log_run("base", "c0", 1, {"seed": 3}, {"success": 0.5}, None, {}, [Path("lab.yaml")]))
folder = policy_folder(Path("policy").resolve(), 2.0)
version = registry.register("of-a-laptop", folder, {"onnx_sha256": "1", "policy": "c0"}, {"success": 0.5}, "# Card")
registry.set_alias("of-a-laptop", "champion", version)
"""
LOG = """
import mlflow
mlflow.set_experiment("of-a-laptop")
with mlflow.start_run() as run:
    mlflow.log_metric("success", 0.5)
    mlflow.log_text("a file", "file.txt")
print(run.info.run_id)
"""
FLOW = """
from prefect import flow
@flow(name="of-a-laptop")
def own():
    return 1
own()
"""
