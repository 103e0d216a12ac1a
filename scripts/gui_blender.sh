#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Run a Python script in a real Blender's window:
#
#   scripts/gui_blender.sh setup
#   scripts/gui_blender.sh run OUTPUT_FOLDER EXTENSION.zip SCRIPT_FOLDER SCRIPT.py [WORDS...]
#
# BLENDER=PATH       use this Blender; without a display, on a virtual screen (needs Xvfb), pictures by ImageMagick
# otherwise          a Debian with Blender is put into a folder of its own (root only): GUI_SUITE=sid (Blender 5.2 LTS) or
#                    trixie (4.3), about 1.3 GB and two minutes, in GUI_ROOT, by default below ~/.cache/eso-lod
# GUI_SIZE=1440x960  the screen;  GUI_SECONDS=1800  the longest that it may take
#
# The machine's own packages stay as they are; mounts and processes are private and end with the run.
set -euo pipefail
SUITE=${GUI_SUITE:-sid}
ROOT=${GUI_ROOT:-${XDG_CACHE_HOME:-$HOME/.cache}/eso-lod/$SUITE}
SIZE=${GUI_SIZE:-1440x960}
SECONDS_MOST=${GUI_SECONDS:-1800}
PACKAGES="blender xvfb xauth imagemagick libopengl0 python3-numpy python3-requests python3-zstandard python3-cattr"

mirror() {  # where this machine gets Debian from
    { sed -n 's/^URIs:[[:space:]]*//p' /etc/apt/sources.list.d/*.sources 2>/dev/null || true
      sed -nE 's/^deb (\[[^]]*\] )?([^ ]+).*/\2/p' /etc/apt/sources.list 2>/dev/null || true
      echo https://deb.debian.org/debian; } | grep -E '/debian/?$' | head -1
}

setup() {
    [ -z "${BLENDER:-}" ] && [ ! -e "$ROOT/.ready" ] || return 0
    [ "$(id -u)" = 0 ] || { echo "Name a Blender (make gui BLENDER=/path/to/blender), or run as root to install one" >&2; exit 2; }
    command -v debootstrap >/dev/null || { apt-get update -qq; DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends debootstrap; }
    echo "Installing Debian $SUITE with Blender in $ROOT ..."
    rm -rf --one-file-system "$ROOT"; mkdir -p "$ROOT"
    debootstrap --variant=minbase --include=ca-certificates "$SUITE" "$ROOT" "$(mirror)" >"$ROOT.log" 2>&1 || { tail -5 "$ROOT.log" >&2; exit 1; }
    printf '%s\n' 'path-exclude=/usr/share/man/*' 'path-exclude=/usr/share/doc/*' force-unsafe-io >"$ROOT/etc/dpkg/dpkg.cfg.d/gui"
    { printf '%s\n' 'APT::Install-Recommends "false";' 'Acquire::Languages "none";' 'Acquire::Retries "3";'
      apt-config dump | grep -E '^Acquire::Check-(Valid-Until|Date) ' || true; } >"$ROOT/etc/apt/apt.conf.d/90gui"
    ln -sf /proc/mounts "$ROOT/etc/mtab"
    inside "export DEBIAN_FRONTEND=noninteractive; apt-get update -qq && apt-get install -y -qq $PACKAGES && apt-get clean" >>"$ROOT.log" 2>&1 \
        || { tail -5 "$ROOT.log" >&2; exit 1; }
    touch "$ROOT/.ready"
}

inside() {  # inside COMMANDS [FOLDER=NAME ...]: run in the Debian, with folders of this machine under names there
    local commands=$1; shift
    COMMANDS=$commands R=$ROOT unshare --mount --pid --fork --kill-child bash -c '
        set -e
        mount -t proc proc "$R/proc"; mount -t sysfs sys "$R/sys"; mount --rbind /dev "$R/dev"
        mount -t tmpfs tmpfs "$R/tmp"; mkdir -m 1777 "$R/tmp/.X11-unix"
        for pair in "$@"; do mkdir -p "$R/${pair#*=}"; mount --bind "${pair%%=*}" "$R/${pair#*=}"; done
        exec chroot "$R" env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 bash -c "$COMMANDS"' _ "$@"
}

run() {
    local out zip folder script=$4 tool tools
    setup
    if [ -n "${BLENDER:-}" ]; then
        command -v "$BLENDER" >/dev/null || { echo "BLENDER=$BLENDER cannot be run: give the path of a Blender" >&2; exit 2; }
        [ -n "${DISPLAY:-}" ] && tools="mogrify import" || tools="Xvfb mogrify import"
        for tool in $tools; do
            command -v "$tool" >/dev/null || { echo "$tool is missing: install Xvfb and ImageMagick (apt-get install xvfb imagemagick)" >&2; exit 2; }
        done
    fi
    mkdir -p "$1"; out=$(realpath "$1"); zip=$(realpath "$2"); folder=$(realpath "$3"); shift 4
    rm -rf "$out/user"; mkdir -p "$out/user"
    if [ -n "${BLENDER:-}" ]; then
        GUI_BLENDER=$BLENDER GUI_OUT=$out bash "$folder/window.sh" "$zip" "$folder/$script" "$SIZE" "$SECONDS_MOST" "$@"
    else
        inside "GUI_BLENDER=blender GUI_OUT=/out exec bash /job/window.sh /zip/$(basename "$zip") /job/$script $SIZE $SECONDS_MOST $(printf '%q ' "$@")" \
            "$folder=job" "$out=out" "$(dirname "$zip")=zip"
    fi
}

case ${1:-} in setup) setup;; run) shift; run "$@";; *) sed -n '3,14p' "$0"; exit 2;; esac
