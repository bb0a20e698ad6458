#!/usr/bin/env python3
"""Strict about what `kubectl kustomize` rendered of deploy/k8s: check_k8s.py BIN_DIR FILE...

No field that is not known here (a typing error would be one), no reference that leads nowhere, no
pod with more rights than it needs, no flag that the programs do not have. Ends with 1 and the list
of what is wrong.
"""
import re
import subprocess
import sys

import yaml

POD = {
    "restartPolicy": 0, "terminationGracePeriodSeconds": 0, "automountServiceAccountToken": 0,
    "enableServiceLinks": 0,
    "securityContext": {"runAsNonRoot": 0, "runAsUser": 0, "runAsGroup": 0, "fsGroup": 0,
                        "seccompProfile": {"type": 0}},
    "containers": [{
        "name": 0, "image": 0, "imagePullPolicy": 0, "command": 0, "args": 0,
        "ports": [{"name": 0, "containerPort": 0}],
        "startupProbe": "probe", "livenessProbe": "probe", "readinessProbe": "probe",
        "resources": {"requests": {"cpu": 0, "memory": 0}, "limits": {"memory": 0}},
        "securityContext": {"allowPrivilegeEscalation": 0, "readOnlyRootFilesystem": 0,
                            "capabilities": {"drop": 0}},
        "volumeMounts": [{"name": 0, "mountPath": 0, "readOnly": 0}]}],
    "volumes": [{"name": 0, "persistentVolumeClaim": {"claimName": 0}, "configMap": {"name": 0},
                 "secret": {"secretName": 0, "defaultMode": 0, "optional": 0},
                 "emptyDir": {"sizeLimit": 0}}],
}
PROBE = {"httpGet": {"path": 0, "port": 0}, "periodSeconds": 0, "failureThreshold": 0}
TEMPLATE = {"metadata": {"labels": "any"}, "spec": POD}
POLICY = {"rules": [{"action": 0, "onExitCodes": {"containerName": 0, "operator": 0, "values": 0},
                     "onPodConditions": [{"type": 0}]}]}
PEERS = [{"podSelector": "selector", "namespaceSelector": "selector"}]
PORTS = [{"port": 0, "protocol": 0}]
SPECS = {
    "Namespace": {}, "ConfigMap": {"data": "any"},
    "PersistentVolumeClaim": {"spec": {"accessModes": 0,
                                       "resources": {"requests": {"storage": 0}}}},
    "Service": {"spec": {"selector": "any", "ports": [{"name": 0, "port": 0}]}},
    "Deployment": {"spec": {"replicas": 0, "selector": "selector", "template": TEMPLATE,
                            "strategy": {"type": 0, "rollingUpdate": {
                                "maxSurge": 0, "maxUnavailable": 0}}}},
    "Job": {"spec": {"backoffLimit": 0, "completionMode": 0, "completions": 0, "parallelism": 0,
                     "ttlSecondsAfterFinished": 0, "podFailurePolicy": POLICY,
                     "template": TEMPLATE}},
    "NetworkPolicy": {"spec": {"podSelector": "selector", "policyTypes": 0,
                               "ingress": [{"from": PEERS, "ports": PORTS}],
                               "egress": [{"to": PEERS, "ports": PORTS}]}},
    "ScaledObject": {"spec": {
        "scaleTargetRef": {"name": 0}, "minReplicaCount": 0, "maxReplicaCount": 0,
        "pollingInterval": 0, "cooldownPeriod": 0,
        "advanced": {"horizontalPodAutoscalerConfig": {"behavior": {"scaleDown": {
            "stabilizationWindowSeconds": 0,
            "policies": [{"type": 0, "value": 0, "periodSeconds": 0}]}}}},
        "triggers": [{"type": 0, "metadata": {"serverAddress": 0, "query": 0, "threshold": 0,
                                              "activationThreshold": 0}}]}},
}
NAMED = {"probe": PROBE, "selector": {"matchLabels": "any"}}
wrong = []


def check(holds, text):
    if not holds:
        wrong.append(text)


def known(value, schema, where):
    schema = NAMED.get(schema, schema) if isinstance(schema, str) else schema
    if schema == "any":
        check(isinstance(value, dict), f"{where}: not a map")
    elif schema == 0:
        check(not isinstance(value, dict), f"{where}: a map")
    elif isinstance(schema, list):
        check(isinstance(value, list), f"{where}: not a list")
        for i, item in enumerate(value if isinstance(value, list) else []):
            known(item, schema[0], f"{where}[{i}]")
    else:
        check(isinstance(value, dict), f"{where}: not a map")
        for key, inner in (value if isinstance(value, dict) else {}).items():
            check(key in schema, f"{where}.{key}: unknown")
            known(inner, schema.get(key, "any" if isinstance(inner, dict) else 0), f"{where}.{key}")


def within(labels, selector):
    return selector and all(labels.get(k) == v for k, v in selector.items())


def check_pod(pod, where, names, bin_dir):
    security = pod.get("securityContext", {})
    check(security.get("runAsNonRoot") is True and security.get("runAsUser", 0) > 0,
          f"{where}: root")
    check(security.get("seccompProfile") == {"type": "RuntimeDefault"}, f"{where}: no seccomp")
    check(pod.get("automountServiceAccountToken") is False, f"{where}: holds a token")
    check(pod.get("terminationGracePeriodSeconds", 0) >= 30, f"{where}: no time to drain")
    volumes = {v["name"]: v for v in pod["volumes"]}
    for c in pod["containers"]:
        rights = c.get("securityContext", {})
        check(rights.get("readOnlyRootFilesystem") is True, f"{where}: writable root")
        check(rights.get("allowPrivilegeEscalation") is False, f"{where}: may gain privileges")
        check(rights.get("capabilities") == {"drop": ["ALL"]}, f"{where}: capabilities")
        check("memory" in c.get("resources", {}).get("limits", {}), f"{where}: no memory limit")
        ports = {p["name"] for p in c.get("ports", [])}
        for probe in ("startupProbe", "livenessProbe", "readinessProbe"):
            if probe in c:
                check(c[probe]["httpGet"]["port"] in ports, f"{where}: {probe}: no such port")
        check({m["name"] for m in c["volumeMounts"]} == set(volumes), f"{where}: mounts")
        words = c["command"] + c["args"]
        sub = ["coordinate"] if "coordinate" in words else []
        usage = "".join(subprocess.run([f"{bin_dir}/{words[0]}", *more, "--help"], check=True,
                                       capture_output=True, text=True).stdout
                        for more in ([], sub))
        for flag in (w for w in words if w.startswith("--")):
            check(re.search(rf"(^|[\s,]){flag}\b", usage), f"{where}: {words[0]} has no {flag}")
    for v in volumes.values():
        if "configMap" in v:
            check(("ConfigMap", v["configMap"]["name"]) in names, f"{where}: {v} is nowhere")
        if "persistentVolumeClaim" in v:
            check(("PersistentVolumeClaim", v["persistentVolumeClaim"]["claimName"]) in names,
                  f"{where}: {v} is nowhere")


def main(bin_dir, *paths):
    objects = []
    for path in paths:
        with open(path, encoding="utf-8") as file:
            objects += [o for o in yaml.safe_load_all(file) if o]
    names = {(o["kind"], o["metadata"]["name"]) for o in objects}
    templates = [(f'{o["kind"]} {o["metadata"]["name"]}', o["spec"]["template"]) for o in objects
                 if o["kind"] in ("Deployment", "Job")]
    labels = [t["metadata"]["labels"] for _, t in templates]
    services = {}
    for o in objects:
        where = f'{o["kind"]} {o["metadata"]["name"]}'
        meta = {"name": 0, "namespace": 0, "labels": "any"}
        check(o["kind"] in SPECS, f"{where}: unknown kind")
        known(o, {"apiVersion": 0, "kind": 0, "metadata": meta, **SPECS.get(o["kind"], {})}, where)
        if o["kind"] != "Namespace":
            check(o["metadata"].get("namespace") == "pvsfarm", f"{where}: not in the namespace")
        spec = o.get("spec", {})
        if o["kind"] == "Service":
            check(any(within(x, spec["selector"]) for x in labels), f"{where}: selects nothing")
            services[o["metadata"]["name"]] = {p["port"] for p in spec["ports"]}
        if o["kind"] == "Deployment":
            check(within(spec["template"]["metadata"]["labels"], spec["selector"]["matchLabels"]),
                  f"{where}: does not select its own pods")
        if o["kind"] == "NetworkPolicy":
            wanted = spec["podSelector"].get("matchLabels")
            check(not wanted or any(within(x, wanted) for x in labels), f"{where}: selects nothing")
        if o["kind"] == "ScaledObject":
            check(("Deployment", spec["scaleTargetRef"]["name"]) in names, f"{where}: no target")
    for where, template in templates:
        check_pod(template["spec"], where, names, bin_dir)
        for word in template["spec"]["containers"][0]["args"]:
            host = re.fullmatch(r"tcp://([a-z-]+):(\d+)", word)
            if host:
                check(int(host[2]) in services.get(host[1], ()), f"{where}: {word} is no service")
    for text in wrong:
        print(text)
    print(f"{len(objects)} objects, {len(wrong)} wrong")
    return 1 if wrong or not objects else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
