#!/usr/bin/env bash
# Workers of a Dask scheduler, one per task of a job array; `scancel` ends them:
#
#     sbatch --array=1-64 dask-workers.sh tcp://login-node:8786
#SBATCH --job-name=shoal-dask
#SBATCH --nodes=1
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=1
#SBATCH --mem-per-cpu=2G
#SBATCH --time=04:00:00
#SBATCH --output=%x-%A_%a.log
set -euo pipefail

scheduler=${1:?usage: sbatch --array=1-COUNT dask-workers.sh tcp://HOST:8786}

# Kernels are made for a processor and locked by files: each node has its own, which its next tasks find again.
export NUMBA_CACHE_DIR="${SHOAL_KERNELS:-/tmp/shoal-kernels-$(id -un)}"
export OPENBLAS_NUM_THREADS=1
# Pages of Dask's would show all computations to other pages in a browser; this leaves /health.
export DASK_DISTRIBUTED__WORKER__HTTP__ROUTES='["shoal_flows.dask_health"]'
export DASK_TEMPORARY_DIRECTORY="${TMPDIR:-/tmp}"

exec dask worker "$scheduler" --nworkers 1 --nthreads 1 --no-dashboard --preload shoal_flows.preload
