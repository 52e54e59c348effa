#!/bin/bash
# A config in parts, by GNU parallel on one machine, and the parts put together:
#
#     parallel.sh 16 study.toml --set materials_dir=brdfs
#
# What follows the config are options of `gonio run`. As many parts run at a time as there are cores, or JOBS=4 of them. On several
# machines that share this folder: PARALLEL='--sshlogin one,two --workdir .' before the command. A part that fails
# stops no other; the same command again goes on with what is left.
set -eu

of=$1
shift
name=$(basename "$1" .toml)
parallel --quote --jobs "${JOBS:-100%}" gonio run "$@" --shard "{}/$of" --threads 1 --quiet \
    --output "runs/$name.shard-{}-of-$of" ::: $(seq "$of") > /dev/null
exec gonio merge runs/"$name".shard-* --output "runs/$name" --force
