#!/usr/bin/env bash
# Installs covol's Debian packages in a fresh Debian 12, and runs the quickstart and the Python module there. Run this
# script as root, with debootstrap installed. It takes some minutes and a GB of disk space, most of it for the packages
# on which covol depends.
#
#     bash tests/packages_in_clean_root.sh BUILD [FOLDER]      FOLDER: for the new root, below /tmp by default
#
# The mirror is the one that this machine's apt uses, or COVOL_MIRROR.
set -euo pipefail
build=$(cd "$1" && pwd)
cd "$(dirname "$0")/.."
work=$(mktemp -d "${2:-/tmp}/covol-root-XXXXXX")
root=$work/root
mirror=${COVOL_MIRROR:-$(apt-get indextargets --format '$(SITE)' 'Created-By: Packages' | head -1)}
finish() {
  umount --lazy "$root/proc" 2>/dev/null || true
  rm -rf --one-file-system "$work"
}
trap finish EXIT
begun=$SECONDS
say() { echo "== $1, after $((SECONDS - begun)) s"; }

cpack -G DEB --config "$build/CPackConfig.cmake" -B "$work/packages" >"$work/cpack.log" 2>&1 || { tail "$work/cpack.log" >&2; exit 1; }
say "packages made"
debootstrap --variant=minbase bookworm "$root" "$mirror" >"$work/debootstrap.log" 2>&1 ||
  { tail -5 "$work/debootstrap.log" >&2; exit 1; }
say "new Debian"
for file in /etc/apt/apt.conf.d/*proxy* /etc/resolv.conf; do
  if [[ -e $file ]]; then install -D -m 644 "$file" "$root$file"; fi
done
mount -t proc proc "$root/proc" 2>/dev/null || true
mkdir "$root/job"
cp "$work"/packages/*.deb "$root/job/"
cp -r houdini_free_examples "$root/job/"
chroot "$root" apt-get update -qq
chroot "$root" sh -c 'DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends /job/*.deb' >"$work/install.log" 2>&1 ||
  { tail -20 "$work/install.log" >&2; exit 1; }
say "packages installed"
chroot "$root" sh -c 'COVOL=covol COVOL_OUT=/job/out bash /job/houdini_free_examples/00_quickstart.sh'
say "quickstart done"
chroot "$root" sh -c 'cd /job && COVOL_OUT=/job/out python3 houdini_free_examples/11_python.py'
say "Python done"
chroot "$root" sh -c 'dpkg -r python3-covol libcovol-dev covol' >/dev/null
if chroot "$root" sh -c 'find / -xdev -name "*covol*" -not -path "/job/*" -not -path "/var/*" -not -path "/proc/*"' | grep .; then
  echo "files stay behind" >&2
  exit 1
fi
say "removed again, nothing left"
