#!/bin/sh
# CalculiX, the shell finite elements of studies/shell: Debian's own package, nothing else is changed.
set -e
if command -v ccx >/dev/null; then
    ccx -v
    exit 0
fi
if [ "$(id -u)" = 0 ]; then
    apt-get install -y calculix-ccx
else
    sudo apt-get install -y calculix-ccx
fi
ccx -v
