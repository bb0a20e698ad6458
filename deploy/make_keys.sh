#!/usr/bin/env bash
# The keys of a farm, in FOLDER (made if need be; what is there already stays):
#   bash deploy/make_keys.sh FOLDER [NAME...]
#   farm.key, farm.pub   the coordinator's; its public key goes to everybody
#   farm.allow           who may come in
#   worker.key           of all workers; or a NAME.key for each NAME, to be able to revoke one alone
#   admin.key            for pvsfarm status, pause, resume, drain and cancel
set -euo pipefail
umask 077
export PATH=$PATH:$(dirname "${BASH_SOURCE[0]}")/../build/release/bin
[ $# -ge 1 ] || { sed -n '2,/^set/{/^set/d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" >&2; exit 1; }
folder=$1
shift
[ $# -gt 0 ] || set -- worker
mkdir -p "$folder"
[ -e "$folder/farm.key" ] || pvsfarm keygen "$folder/farm.key" > "$folder/farm.pub"
for name in "$@"; do
  [ -e "$folder/$name.key" ] ||
    pvsfarm keygen "$folder/$name.key" --role worker --name "$name" >> "$folder/farm.allow"
done
[ -e "$folder/admin.key" ] ||
  pvsfarm keygen "$folder/admin.key" --role admin --name admin >> "$folder/farm.allow"
chmod 644 "$folder/farm.allow" "$folder/farm.pub"  # public keys
