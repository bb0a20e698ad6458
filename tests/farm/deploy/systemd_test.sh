#!/usr/bin/env bash
# The units of deploy/systemd, installed below a folder: systemd finds nothing wrong in them and
# little that they could do to the machine, and their programs know every flag that they give.
here=$(dirname "${BASH_SOURCE[0]}")
source "$here/common.sh"
need systemd-analyze

DESTDIR=$folder/root bash "$source/deploy/systemd/install.sh" worker "$bin"
DESTDIR=$folder/root bash "$source/deploy/systemd/install.sh" coordinator "$bin"

instance() {  # UNIT INSTANCE: the unit as it would be started, in a folder of its own
  sed "s#/usr/local/bin/#$folder/root/usr/local/bin/#" \
    "$folder/root/etc/systemd/system/$1@.service" > "$folder/$1@$2.service"
  echo "$folder/$1@$2.service"
}
for unit in pvsfarm-worker pvsfarm-coordinator; do
  file=$(instance "$unit" one)
  systemd-analyze verify --man=no --recursive-errors=no "$file" > "$folder/verify.log" 2>&1 ||
    { cat "$folder/verify.log"; fail "$unit does not verify"; }
  [ ! -s "$folder/verify.log" ] || { cat "$folder/verify.log"; fail "$unit: warnings"; }
  score=$(systemd-analyze security --offline=yes --no-pager "$file" |
    sed -n 's/.*exposure level for [^:]*: \([0-9.]*\).*/\1/p')
  systemd-analyze security --offline=yes --threshold=30 --no-pager "$file" > /dev/null ||
    fail "$unit: exposure $score, more than 3"
  say "$unit: exposure $score (asked: at most 3)"
  read -ra words <<< "$(sed -n 's/^ExecStart=//p' "$file")"
  sub=()
  [ "$unit" = pvsfarm-worker ] || sub=(coordinate)
  "${words[0]}" "${sub[@]}" --help > "$folder/help.txt"
  for word in "${words[@]}"; do
    [[ $word != --* ]] || grep -qE -- "(^|[ ,])$word( |$)" "$folder/help.txt" ||
      fail "$unit: its program has no $word"
  done
done
# What the worker asks of whoever starts it: 42 never again, and 30 s for its last cell.
worker=$source/deploy/systemd/pvsfarm-worker@.service
grep -qx 'RestartPreventExitStatus=42' "$worker" || fail "42 is started again"
[ "$(sed -n 's/^TimeoutStopSec=//p' "$worker")" -ge 30 ] || fail "no time to drain"
