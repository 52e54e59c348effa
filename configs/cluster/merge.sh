#!/bin/bash
# Puts the parts that array.sh made of a config together, in runs/NAME (array.sh has the command). Exit code 5: some are
# missing; what is there is written all the same.

##SBATCH --account=NAME
##SBATCH --partition=NAME
#SBATCH --time=00:30:00
#SBATCH --mem=4G
# Where a task has failed this job would wait for ever.
#SBATCH --kill-on-invalid-dep=yes
#SBATCH --job-name=gonio-merge
#SBATCH --output=%x-%j.log
set -eu

name=$(basename "$1" .toml)
exec gonio merge runs/"$name".shard-* --output "runs/$name" --force
