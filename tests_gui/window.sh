#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# window.sh ZIP SCRIPT WxH SECONDS [WORDS...]: install the add-on in a fresh user folder, open Blender, run the script in it.
# Reads GUI_BLENDER and GUI_OUT. Called by scripts/gui_blender.sh, on this machine or in the Debian it has made.
set -euo pipefail
zip=$1 script=$2 size=$3 seconds=$4; shift 4
# A home as people have them: with spaces and letters from elsewhere.
export HOME="$GUI_OUT/user/häuschen mit Platz 家"
export BLENDER_USER_RESOURCES="$HOME/blender ファイル"
mkdir -p "$BLENDER_USER_RESOURCES"
rm -f "$GUI_OUT"/*.png
"$GUI_BLENDER" --command extension install-file -r user_default --enable "$zip"
if [ -z "${DISPLAY:-}" ]; then
    export LIBGL_ALWAYS_SOFTWARE=1 GALLIUM_DRIVER=llvmpipe
    # the screen takes a number that is free: others may have screens of their own
    rm -f "$GUI_OUT/display"  # of a run before: it would be read before the new one is there
    Xvfb -displayfd 1 -screen 0 "${size}x24" +extension GLX -nolisten tcp >"$GUI_OUT/display" 2>"$GUI_OUT/screen.log" & screen=$!
    trap 'kill $screen 2>/dev/null || true' EXIT
    for _ in $(seq 200); do [ -s "$GUI_OUT/display" ] && break; sleep 0.1; done
    export DISPLAY=":$(cat "$GUI_OUT/display")"
fi
timeout "$seconds" "$GUI_BLENDER" --enable-event-simulate --window-geometry 0 0 "${size%x*}" "${size#*x}" --python-exit-code 3 \
    --python-expr 'import bpy; bpy.context.preferences.view.show_splash = False' --python "$script" -- "$@"
# Few colours are enough for the pages that show them.
mkdir -p "$GUI_OUT/pictures"
mogrify -path "$GUI_OUT/pictures" -dither None -colors 128 -define png:compression-level=9 "$GUI_OUT"/[a-z]*.png
