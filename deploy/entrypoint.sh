#!/bin/sh
# Settings that a container has to make before its program starts.
set -eu

# Both drivers of PostgreSQL read the password from the environment, and Compose brings it as a file.
if [ -n "${PGPASSWORD_FILE:-}" ]; then
  PGPASSWORD="$(cat "$PGPASSWORD_FILE")"
  export PGPASSWORD
fi

# Numba wants to write where it reads compiled kernels; the image is read-only. Each build has a folder of its own, for a
# kernel is no longer right when a source that it calls has changed. Of several containers that begin together one is first.
image="${SHOAL_IMAGE:-/opt/shoal}"
if [ -n "${NUMBA_CACHE_DIR:-}" ] && [ -f "$image/kernels.version" ]; then
  kernels="$NUMBA_CACHE_DIR/$(cat "$image/kernels.version")"
  if [ ! -d "$kernels" ]; then
    mkdir -p "$NUMBA_CACHE_DIR"
    fresh="$(mktemp -d "$NUMBA_CACHE_DIR/.new-XXXXXX")"
    cp -R "$image/kernels/." "$fresh"
    mv -T "$fresh" "$kernels" 2> /dev/null || rm -rf "$fresh"
  fi
  export NUMBA_CACHE_DIR="$kernels"
fi

exec "$@"
