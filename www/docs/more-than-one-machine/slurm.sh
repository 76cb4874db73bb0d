#!/bin/sh
# A Slurm array: sbatch --array=1-8 slurm.sh synth 8
# To repeat one job of it: sbatch --array=3 slurm.sh synth 8
#SBATCH --job-name=deepsft
#SBATCH --cpus-per-task=2
#SBATCH --time=04:00:00
#SBATCH --requeue
set -eu
exec ./job.sh "$1" "$SLURM_ARRAY_TASK_ID" "$2"
