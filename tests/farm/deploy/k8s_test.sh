#!/usr/bin/env bash
# deploy/k8s, rendered offline, and looked at strictly.
here=$(dirname "${BASH_SOURCE[0]}")
source "$here/common.sh"
need kubectl python3
python3 -c 'import yaml' 2> /dev/null || skip "python3-yaml is not installed"
for part in coordinator workers workers-job autoscaling; do
  kubectl kustomize "$source/deploy/k8s/$part" > "$folder/$part.yaml"
done
python3 "$here/check_k8s.py" "$bin" "$folder"/*.yaml
