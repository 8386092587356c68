# How large the image may be. Sourced.
# shellcheck shell=bash

budget="2.00 GB"

# within SIZE LIMIT: whether a size as buildah and docker print it, such as "1.93 GB", is at most another
within() {
  awk -v size="$1" -v limit="$2" '
    function bytes(text, part, power) {
      if (split(text, part, " ") != 2 || part[1] !~ /^[0-9.]+$/) exit 2
      power = index("B  kB MB GB TB ", part[2] " ")
      if (!power) exit 2
      return part[1] * 1000 ^ ((power - 1) / 3)
    }
    BEGIN { exit bytes(size) > bytes(limit) }'
}

# Megabytes of the parts of an image that any user may read; the paths are those of the Dockerfile.
parts='du -sx --apparent-size --block-size=1MB /usr/lib/*-linux-gnu /usr/lib/python3* /usr/lib/petscdir /usr/lib/gcc \
  /usr/libexec /usr/bin /usr/share /usr/include /opt/gapbeam/lib/python3.*/site-packages/vtkmodules \
  /opt/gapbeam/lib/python3.*/site-packages/llvmlite /opt/gapbeam/lib/python3.*/site-packages/plotly /home/gapbeam'
# du counts a folder once: those inside /opt/gapbeam first, then what is left of it
parts+=' /opt/gapbeam'
