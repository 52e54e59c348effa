#!/bin/bash
# A config as the tasks of a Slurm array, and its parts put together when all are done:
#
#     tasks=$(sbatch --parsable array.sh study.toml --set materials_dir=brdfs)
#     sbatch --dependency=afterok:$tasks merge.sh study.toml
#
# What follows the config are options of `gonio run`; those of sbatch stand before array.sh and win over the lines below.
# The same two commands again, after whatever went wrong, go on where the parts were; those that are done end at once.
# Always ask for the whole array: --array=3 alone would be part 3 of 1, which is refused. `gonio` must be in PATH.

# What your cluster wants to know; a second # keeps a line from Slurm.
##SBATCH --account=NAME
##SBATCH --partition=NAME
#SBATCH --time=04:00:00
#SBATCH --mem=2G
#SBATCH --cpus-per-task=1
# From 1; as many parts as there are tasks. 1-16%4 runs four at a time.
#SBATCH --array=1-16
# A task that was preempted, or whose node failed, is put into the queue again.
#SBATCH --requeue
# A minute before its time is over it is asked to stop: it writes its tables and ends with 130.
#SBATCH --signal=B:TERM@60
#SBATCH --job-name=gonio
#SBATCH --output=%x-%A_%a.log
#SBATCH --open-mode=append
set -eu

name=$(basename "$1" .toml)
part=$SLURM_ARRAY_TASK_ID of=$SLURM_ARRAY_TASK_COUNT
# exec, so that it is gonio that Slurm asks to stop.
exec gonio run "$@" --shard "$part/$of" --threads "$SLURM_CPUS_PER_TASK" --quiet \
    --output "runs/$name.shard-$part-of-$of"
