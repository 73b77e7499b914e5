#!/bin/sh
# Settings that a container has to make before its program starts.
set -eu

# Both drivers of PostgreSQL read the password from the environment, and Compose brings it as a file.
if [ -n "${PGPASSWORD_FILE:-}" ]; then
  PGPASSWORD="$(cat "$PGPASSWORD_FILE")"
  export PGPASSWORD
fi

# Numba wants to write where it reads compiled kernels; the image is read-only.
if [ -n "${NUMBA_CACHE_DIR:-}" ] && [ -d /opt/shoal/kernels ] && [ ! -d "$NUMBA_CACHE_DIR" ]; then
  cp -R /opt/shoal/kernels "$NUMBA_CACHE_DIR"
fi

exec "$@"
