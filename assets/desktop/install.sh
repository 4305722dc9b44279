#!/bin/sh
# Put this folder's fluidwarp into the menu of the person who calls it: sh install.sh; to take it out: sh install.sh --remove
set -eu
here=$(cd "$(dirname "$0")" && pwd)
data=${XDG_DATA_HOME:-$HOME/.local/share}
entry=$data/applications/fluidwarp.desktop
kind=$data/mime/packages/fluidwarp.xml
icon=$data/icons/hicolor/scalable/apps/fluidwarp.svg
if [ "${1:-}" = --remove ]; then
    rm -f "$entry" "$kind" "$icon"
else
    mkdir -p "${entry%/*}" "${kind%/*}" "${icon%/*}"
    # In a quoted argument \ " ` $ are escaped, in a value every \ once more; % of a path is doubled.
    program=$(printf '%s' "$here/fluidwarp" | sed 's/[\\"`$]/\\&/g; s/\\/\\\\/g; s/%/%%/g')
    export program
    awk '/^Exec=/ { print "Exec=\"" ENVIRON["program"] "\" edit %f"; next } { print }' \
        "$here/fluidwarp.desktop" > "$entry"
    cp "$here/fluidwarp.xml" "$kind"
    cp "$here/fluidwarp.svg" "$icon"
fi
# Where the desktop keeps lists of what is there; one that has none finds it by itself.
for update in "update-mime-database $data/mime" "update-desktop-database $data/applications"; do
    if command -v "${update%% *}" > /dev/null; then ${update%% *} "${update#* }" || true; fi
done
