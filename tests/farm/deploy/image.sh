# Images and an engine without a registry; sourced after common.sh. The image is that of
# deploy/containers/Dockerfile, on a base from debootstrap, with the programs of this build.
# What takes long is kept in BUILD/containers: the base, and the layers of the image.
kept=$(cd "$bin/.." && pwd)/containers
storage=(--root "$kept/storage" --runroot "$kept/run" --storage-driver overlay)
net=pvsc$$
image=localhost/pvsfarm-test

# All networks of the engine are in a namespace of the test's own.
# Conmon leaves a file where it stands when a container runs out of memory.
engine() { (cd "$folder" && nsenter --net="/run/netns/$net" "$folder/podman" "$@"); }

start_engine() {
  mkdir -p "$kept" "$folder/networks"
  cat > "$folder/containers.conf" << END
[containers]
default_ulimits=["nofile=20000:20000","nproc=4096:4096"]
[engine]
runtime="runc"
cgroup_manager="cgroupfs"
events_logger="file"
[network]
network_backend="netavark"
network_config_dir="$folder/networks"
END
  export CONTAINERS_CONF=$folder/containers.conf
  printf '#!/bin/sh\nexec podman %s "$@"\n' "${storage[*]}" > "$folder/podman"
  chmod 755 "$folder" "$folder/podman"
  undo+=('umount "$kept/storage/overlay" 2> /dev/null || true')
  add_namespace "$net"
  ip -n "$net" link set lo up
  # A namespace without an address confuses getaddrinfo.
  ip -n "$net" link add eth0 type veth peer name eth1
  ip -n "$net" address add 10.214.9.1/24 dev eth0
  ip -n "$net" link set eth0 up
  undo+=('engine pod rm --all --force --time 1 > /dev/null 2>&1'
         'engine rm --all --force --time 1 > /dev/null 2>&1')
}

make_base() {
  if [ ! -s "$kept/base.tar" ]; then
    say "making a base by debootstrap"
    debootstrap --variant=minbase bookworm "$folder/rootfs" > "$folder/debootstrap.log" 2>&1 ||
      skip "no base image: $(tail -n 1 "$folder/debootstrap.log")"
    # As Debian's slim images.
    tar -C "$folder/rootfs" --exclude='./var/cache/apt/*' --exclude='./var/lib/apt/lists/*' \
      --exclude='./usr/share/doc/*' --exclude='./usr/share/man/*' --exclude='./usr/share/info/*' \
      --exclude='./usr/share/locale/*' -cf "$kept/base.tar.new" .
    mv "$kept/base.tar.new" "$kept/base.tar"
    rm -rf "$folder/rootfs"
  fi
  buildah "${storage[@]}" inspect --type image localhost/pvsfarm-base > /dev/null 2>&1 && return
  local container
  container=$(buildah "${storage[@]}" from scratch)
  buildah "${storage[@]}" add -q "$container" "$kept/base.tar" / > /dev/null
  buildah "${storage[@]}" commit -q --rm "$container" localhost/pvsfarm-base > /dev/null
}

build_image() {
  local context=$folder/context
  make_base
  mkdir -p "$context/prebuilt"
  cp -r "$source/deploy" "$context/"
  cp "$bin/pvsfarm" "$bin/pvsfarm-worker" "$context/prebuilt/"
  strip "$context"/prebuilt/*
  bash "$source/deploy/runtime_packages.sh" "$bin/pvsfarm" "$bin/pvsfarm-worker" \
    > "$context/prebuilt/runtime-packages.txt"
  say "building the image"
  buildah "${storage[@]}" bud --layers --isolation chroot \
    --build-arg BASE=localhost/pvsfarm-base --build-arg PREBUILT=prebuilt \
    -t "$image" -f "$context/deploy/containers/Dockerfile" "$context" \
    > "$folder/build.log" 2>&1 || fail "the image does not build"
  say "built: $(engine image inspect "$image" --format '{{.Size}}') bytes"
}
