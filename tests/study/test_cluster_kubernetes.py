"""The page's program for Kubernetes, compared with the operator's own description of a cluster.

Nothing is run: what dask-kubernetes would ask for is made by its own functions, out of its wheel.
"""

import ast
import copy
import os
import re
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

PAGE = (Path(__file__).resolve().parents[2] / "book/cluster.md").read_text()
(VERSION,) = re.findall(r"pip install dask-kubernetes==([\d.]+)`", PAGE)
WHEEL = "NMPCRL_DASK_KUBERNETES"  # where the wheel is, which is no part of environment.txt
CRD = "dask_kubernetes/operator/deployment/helm/dask-kubernetes-operator/crds/daskcluster.yaml"
SOURCE = "dask_kubernetes/operator/kubecluster/kubecluster.py"

jsonschema = pytest.importorskip("jsonschema")


@pytest.fixture(scope="module")
def wheel() -> Iterator[zipfile.ZipFile]:
    if not os.environ.get(WHEEL):
        pytest.skip(f"{WHEEL} names no wheel: pip download --no-deps dask-kubernetes=={VERSION}")
    path = Path(os.environ[WHEEL])
    assert path.name == f"dask_kubernetes-{VERSION}-py3-none-any.whl"
    with zipfile.ZipFile(path) as opened:
        yield opened


@pytest.fixture(scope="module")
def source(wheel) -> ast.Module:
    return ast.parse(wheel.read(SOURCE))


@pytest.fixture(scope="module")
def asked() -> dict[str, Any]:
    """What the page's program gives `KubeCluster`."""
    calls = [
        node
        for text in re.findall(r"^```python\n(.*?)^```$", PAGE, flags=re.DOTALL | re.MULTILINE)
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "KubeCluster"
    ]
    (call,) = calls
    assert not call.args
    return {str(keyword.arg): ast.literal_eval(keyword.value) for keyword in call.keywords}


@pytest.fixture(scope="module")
def cluster(source, asked) -> dict[str, Any]:
    """The description of the cluster that is sent to Kubernetes, by the wheel's own functions."""
    made: dict[str, Any] = {}
    functions = [node for node in source.body if isinstance(node, ast.FunctionDef)]
    wanted = [node for node in functions if node.name.startswith("make_")]
    exec(compile(ast.Module(wanted, []), SOURCE, "exec"), made)
    description: dict[str, Any] = made["make_cluster_spec"](**asked)
    return description


@pytest.fixture(scope="module")
def schema(wheel) -> dict[str, Any]:
    """What the operator takes for a cluster; a field that it does not know is an error here."""
    crd = yaml.load(wheel.read(CRD), Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    (version,) = crd["spec"]["versions"]
    return closed(version["schema"]["openAPIV3Schema"])


def closed(schema: Any) -> Any:
    """The same schema, which refuses fields that it does not name: Kubernetes would drop them."""
    if isinstance(schema, list):
        return [closed(one) for one in schema]
    if not isinstance(schema, dict):
        return schema
    shut = {name: closed(value) for name, value in schema.items()}
    if isinstance(schema.get("properties"), dict) and schema.get("type") == "object":
        shut.setdefault("additionalProperties", False)
    return shut


def without_head(cluster: dict[str, Any]) -> dict[str, Any]:
    """Kubernetes itself knows the fields that every description begins with."""
    return {name: cluster[name] for name in cluster if name == "spec"}


def test_the_program_gives_what_kubecluster_takes(source, asked):
    (taker,) = [
        method
        for node in source.body
        if isinstance(node, ast.ClassDef) and node.name == "KubeCluster"
        for method in node.body
        if isinstance(method, ast.FunctionDef) and method.name == "__init__"
    ]
    assert set(asked) <= {argument.arg for argument in taker.args.kwonlyargs}


def test_the_operator_takes_the_description_of_the_cluster(cluster, schema):
    jsonschema.validate(without_head(cluster), schema)
    assert (cluster["apiVersion"], cluster["kind"]) == ("kubernetes.dask.org/v1", "DaskCluster")


@pytest.mark.parametrize(
    ("field", "value"),
    [("requests", {"cpu": [1]}), ("requets", {"cpu": "1"}), ("limits", "2Gi")],
)
def test_a_slip_in_what_a_pod_is_given_would_be_noticed(cluster, schema, field, value):
    wrong = copy.deepcopy(without_head(cluster))
    wrong["spec"]["worker"]["spec"]["containers"][0]["resources"][field] = value
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(wrong, schema)


def test_what_a_pod_runs_is_a_command_of_dask(cluster):
    command = pytest.importorskip("distributed.cli.dask_worker").main
    for part in ("scheduler", "worker"):
        (container,) = cluster["spec"][part]["spec"]["containers"]
        if part == "worker":
            assert container["args"][:2] == ["dask", "worker"]
            command.make_context("dask worker", container["args"][2:])
        variables = {one["name"]: one["value"] for one in container["env"]}
        assert variables == {"DASK_DISTRIBUTED__SCHEDULER__WORKER_SATURATION": "1.0"}


def test_the_chart_that_the_page_installs_is_that_of_the_operator(wheel):
    chart = yaml.safe_load(wheel.read(CRD.replace("crds/daskcluster.yaml", "Chart.yaml")))
    assert f"--generate-name {chart['name']}\n" in PAGE
