#!/usr/bin/env bash
# Installs pvsfarm for systemd on this machine: programs, unit, and an example of what the unit
# wants to know, unless it is there.
#   sudo bash deploy/systemd/install.sh worker [FOLDER_OF_THE_PROGRAMS]
#   sudo bash deploy/systemd/install.sh coordinator [FOLDER_OF_THE_PROGRAMS]
# DESTDIR=/elsewhere puts it all below that folder and leaves systemd alone.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
what=${1:-}
programs=${2:-$here/../../build/release/bin}
root=${DESTDIR:-}
case $what in
  worker) program=pvsfarm-worker ;;
  coordinator) program=pvsfarm ;;
  *) sed -n '2,/^set/{/^set/d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" >&2; exit 1 ;;
esac

if [ -z "$root" ]; then  # what the program loads; on the machine that built it, it is there
  ! ldd "$programs/$program" | grep 'not found' >&2 ||
    { echo "install.sh: install these libraries first" >&2; exit 5; }
fi
install -D -m 755 -t "$root/usr/local/bin" "$programs/$program"
install -D -m 644 -t "$root/etc/systemd/system" "$here/pvsfarm-$what@.service"
install -d -m 755 "$root/etc/pvsfarm"
if [ "$what" = worker ] && [ ! -e "$root/etc/pvsfarm/worker.env" ]; then
  echo 'PVSFARM_CONNECT=tcp://coordinator.example:5555' > "$root/etc/pvsfarm/worker.env"
fi
if [ "$what" = coordinator ] && [ ! -e "$root/etc/pvsfarm/example.env" ]; then
  cat > "$root/etc/pvsfarm/example.env" << 'END'
PVSFARM_SCENE=/srv/scenes/example.glb
PVSFARM_BIND=tcp://0.0.0.0:5555
PVSFARM_OPTIONS=--json
END
fi
[ -n "$root" ] || systemctl daemon-reload
echo "installed: $root/etc/systemd/system/pvsfarm-$what@.service; now fill $root/etc/pvsfarm"
