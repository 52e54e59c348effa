#!/bin/sh
# A laboratory that chooses its poses from its readings, by files alone: poses, readings, further poses.
#
#   tests/lab.sh GONIO CONFIG MATERIAL INSTRUMENT BATCHES [STEPS]
#
# in an empty folder, or in one where it was broken off: every step whose file is there is left alone. At most
# STEPS steps are done then. Ends with the error of the BRDF from all readings.
set -eu
gonio=$1 config=$2 material=$3 instrument=$4 batches=$5 steps=${6:-1000}

step() {
    [ -e "$1" ] && return
    [ "$steps" -gt 0 ] || exit 0
    steps=$((steps - 1))
    file=$1
    shift
    "$@" -o "$file"
}

readings=
size=8
for batch in $(seq "$batches"); do
    # shellcheck disable=SC2086
    step "poses$batch.csv" "$gonio" next $readings --batch "$size" --instrument "$instrument"
    step "readings$batch.csv" "$gonio" measure "poses$batch.csv" --config "$config" \
        --material "$material" --instrument "$instrument"
    readings="$readings readings$batch.csv"
    [ "$batch" -gt 1 ] && size=$((2 * size))
done
# shellcheck disable=SC2086
"$gonio" reconstruct $readings --reconstruction kriging --against "$config" --material "$material"
