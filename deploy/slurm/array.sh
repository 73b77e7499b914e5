#!/usr/bin/env bash
# One command of shoal per task of a job array, each on one node:
#
#     sbatch --array=1-$(wc -l < tasks.txt) array.sh tasks.txt
#
# A line of the file is what follows `shoal`, for example: identify find.yaml --data run-3.csv --out run-3.json
# The exit status of a task is that of the command: 0 trusted, 2 bad input, 3 failed or rejected.
#SBATCH --job-name=shoal
#SBATCH --nodes=1
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=2
#SBATCH --mem-per-cpu=2G
#SBATCH --time=01:00:00
#SBATCH --output=%x-%A_%a.log
set -euo pipefail

tasks=${1:?usage: sbatch --array=1-COUNT array.sh tasks.txt}
line=$(sed -n "${SLURM_ARRAY_TASK_ID:?is set by sbatch --array}p" "$tasks")
[ -n "$line" ] || { echo "$tasks has no line $SLURM_ARRAY_TASK_ID" >&2; exit 2; }

# Kernels are made for a processor and locked by files: each node has its own, which its next tasks find again.
export NUMBA_CACHE_DIR="${SHOAL_KERNELS:-/tmp/shoal-kernels-$(id -un)}"
export OPENBLAS_NUM_THREADS=1

# Quotes and redirections of the line count.
eval "exec shoal $line"
