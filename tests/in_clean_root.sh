#!/usr/bin/env bash
# Tests the installation of a distributed file in fresh Debian systems without a compiler: installs it, and runs the job
# of the quickstart and covol mark as an unprivileged user. Run this script as root, with debootstrap installed.
#
#     bash tests/in_clean_root.sh BUNDLE.tar.xz|COVOL.whl|COVOL.deb [RELEASE...]
#
# By default, a bundle is tested in bookworm and trixie, a wheel and a package in bookworm. The printed time of the
# installation begins when the fresh Debian is ready; for a wheel, this Debian includes Python's venv and NumPy. For a
# package, the time includes the downloads of apt-get. The mirror is that of this machine's apt, or COVOL_MIRROR.
set -euo pipefail
file=$(realpath "$1")
shift
case $file in
  *.tar.xz) releases=(bookworm trixie) include=() ;;
  *.whl) releases=(bookworm) include=(--include=python3-venv,python3-numpy) ;;
  *.deb) releases=(bookworm) include=() ;;
  *) echo "$file: expected a bundle (.tar.xz), a wheel (.whl) or a package (.deb)" >&2; exit 2 ;;
esac
(( $# > 0 )) && releases=("$@")
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

put_there() {
  case $file in
    *.tar.xz) xz -dc "$file" | tar x -C "$home"; covol=$(cd "$home" && echo ./covol-*/bin/covol) ;;
    *.whl)
      cp "$file" "$home/"
      as_person "python3 -m venv --system-site-packages venv && venv/bin/pip install --quiet --no-index ./*.whl"
      covol=venv/bin/covol ;;
    *.deb)
      cp "$file" "$root/root/"
      chroot "$root" apt-get update -qq
      chroot "$root" sh -c 'DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends /root/*.deb' >"$work/install.log" 2>&1 ||
        { tail -20 "$work/install.log" >&2; exit 1; }
      covol=covol ;;
  esac
}
as_person() { chroot "$root" setpriv --reuid person --regid person --clear-groups env -i HOME=/home/person PATH=/usr/bin:/bin bash -c "cd; $1"; }

for release in "${releases[@]}"; do
  root=$work/$release
  debootstrap --variant=minbase "${include[@]}" "$release" "$root" "$mirror" >"$work/$release.log" 2>&1 || { tail -5 "$work/$release.log" >&2; exit 1; }
  for settings in /etc/apt/apt.conf.d/*proxy* /etc/resolv.conf; do
    if [[ -e $settings ]]; then mkdir -p "$(dirname "$root$settings")" && cp -L "$settings" "$root$settings"; fi
  done
  mount -t proc proc "$root/proc"
  chroot "$root" useradd --create-home person
  home=$root/home/person
  cp -r houdini_free_examples "$home/"
  chroot "$root" chown -R person: /home/person
  chroot "$root" sh -c 'command -v cc g++ gcc cmake' && { echo "$release: there is a compiler" >&2; exit 1; }
  begun=$SECONDS
  put_there
  echo "$release: installed after $((SECONDS - begun)) s"
  as_person "$covol --version"
  as_person "d=houdini_free_examples/data; $covol segment \$d/celegans_embryo.tif --points \$d/celegans_marks.csv \
    --voxel-size 3 -o embryo.vdb --mesh embryo.ply --mask embryo_mask.tif --report embryo.html --quiet && \
    $covol compare embryo.vdb \$d/celegans_check.csv"
  # The page of covol mark is served at the printed address, which contains a secret, and refused at any other path.
  as_person "$covol"' mark houdini_free_examples/data/celegans_embryo.tif study --no-browser >mark.log 2>&1 & program=$!
    trap "kill -INT $program" EXIT
    for n in $(seq 100); do grep -q "http://" mark.log && break; sleep 0.1; done
    [[ $(cat mark.log) =~ http://127.0.0.1:([0-9]+)(/[^[:space:]]*) ]]
    get() { exec 3<>/dev/tcp/127.0.0.1/$1; printf "GET %s HTTP/1.1\r\nHost: 127.0.0.1:%s\r\nConnection: close\r\n\r\n" "$2" "$1" >&3; head -1 <&3; }
    port=${BASH_REMATCH[1]} path=${BASH_REMATCH[2]}
    answer=$(get $port "$path"); refused=$(get $port /)
    echo "page: $answer; without its secret: $refused"
    [[ $answer == *" 200 "* || $answer == *" 30"* ]] && [[ $refused == *" 40"* ]]'
  chroot "$root" sh -c 'command -v cc g++ gcc cmake' && { echo "$release: a compiler was installed" >&2; exit 1; }
  echo "== $release, glibc $(chroot "$root" ldd --version | head -1 | grep -o '[0-9.]*$'), $(basename "$file"): from the file to the page in $((SECONDS - begun)) s"
done
