#!/usr/bin/env bash
# Unpacks the bundle in new Debians that have nothing but their base system, and runs it there as a user without rights:
# version, the quickstart's job, the page of covol mark. As root, with debootstrap; about two minutes a release.
#
#     bash tests/bundle_in_clean_root.sh BUNDLE.tar.xz [RELEASE...]      bookworm and trixie by default
#
# The mirror is the one that this machine's apt uses, or COVOL_MIRROR.
set -euo pipefail
bundle=$(realpath "$1")
shift
releases=("$@")
(( ${#releases[@]} > 0 )) || releases=(bookworm trixie)
cd "$(dirname "$0")/.."
mirror=${COVOL_MIRROR:-$(apt-get indextargets --format '$(SITE)' 'Created-By: Packages' | head -1)}
work=$(mktemp -d /tmp/covol-root-XXXXXX)
finish() {
  for root in "$work"/*/; do
    umount --lazy "$root/proc" 2>/dev/null || true
  done
  rm -rf --one-file-system "$work"
}
trap finish EXIT

for release in "${releases[@]}"; do
  root=$work/$release
  debootstrap --variant=minbase "$release" "$root" "$mirror" >"$work/$release.log" 2>&1 || { tail -5 "$work/$release.log" >&2; exit 1; }
  mount -t proc proc "$root/proc"
  chroot "$root" useradd --create-home person
  home=$root/home/person
  begun=$SECONDS
  chroot "$root" sh -c 'command -v cc g++ gcc cmake' && { echo "$release: there is a compiler" >&2; exit 1; }
  xz -dc "$bundle" | tar x -C "$home"
  cp -r houdini_free_examples "$home/"
  chroot "$root" chown -R person: /home/person
  as_person() { chroot "$root" setpriv --reuid person --regid person --clear-groups env -i HOME=/home/person PATH=/usr/bin:/bin bash -c "cd; $1"; }
  as_person './covol-*/bin/covol --version'
  as_person 'd=houdini_free_examples/data; ./covol-*/bin/covol segment $d/celegans_embryo.tif --points $d/celegans_marks.csv \
    --voxel-size 3 -o embryo.vdb --mesh embryo.ply --mask embryo_mask.tif --report embryo.html --quiet && \
    ./covol-*/bin/covol compare embryo.vdb $d/celegans_check.csv'
  # The page answers its one address, and nothing else.
  as_person './covol-*/bin/covol mark houdini_free_examples/data/celegans_embryo.tif study --no-browser >mark.log 2>&1 & program=$!
    trap "kill -INT $program" EXIT
    for n in $(seq 100); do grep -q "http://" mark.log && break; sleep 0.1; done
    [[ $(cat mark.log) =~ http://127.0.0.1:([0-9]+)(/[^[:space:]]*) ]]
    get() { exec 3<>/dev/tcp/127.0.0.1/$1; printf "GET %s HTTP/1.1\r\nHost: 127.0.0.1:%s\r\nConnection: close\r\n\r\n" "$2" "$1" >&3; head -1 <&3; }
    port=${BASH_REMATCH[1]} path=${BASH_REMATCH[2]}
    answer=$(get $port "$path"); refused=$(get $port /)
    echo "page: $answer; without its secret: $refused"
    [[ $answer == *" 200 "* || $answer == *" 30"* ]] && [[ $refused == *" 40"* ]]'
  echo "== $release, glibc $(chroot "$root" ldd --version | head -1 | grep -o '[0-9.]*$'): unpacked and run after $((SECONDS - begun)) s"
done
