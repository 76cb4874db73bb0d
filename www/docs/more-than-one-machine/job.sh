#!/bin/sh
# One job of many. Every scheduler calls this script with a number; the script knows no scheduler.
#
#   job.sh synth NUMBER OF   write part NUMBER of OF of the data set OUT        needs TEMPLATE, COUNT, SEED, OUT
#   job.sh train NUMBER OF   train a network for every OFth folder of TEMPLATES  needs TEMPLATES, MINUTES, OUT
#   job.sh track NUMBER OF   track every OFth video of VIDEOS                    needs MODEL, VIDEOS, OUT; CAMERA if known
#
# NUMBER counts from 1. A job may run again after it was killed: it skips what is finished and resumes what is not. One bad
# template or video does not stop the others; the job then fails at its end.
set -eu
kind=$1 number=$2 of=$3
export PATH="${DEEPSFT_BIN:-.}:$PATH"

# Prints the entries of folder $1 that are this job's: number, number + of, number + 2 of, ...
ours() {
    at=0
    for entry in "$1"/*; do
        at=$((at + 1))
        if [ $((at % of)) -eq $((number % of)) ]; then printf '%s\n' "$entry"; fi
    done
}

case $kind in
synth)
    deepsft synth --template "$TEMPLATE" --count "$COUNT" --seed "$SEED" --shard "$number/$of" --out "$OUT"
    ;;
train)
    mkdir -p "$OUT"
    ours "$TEMPLATES" | {
        failed=0
        while IFS= read -r template; do
            model=$OUT/$(basename "$template")
            if [ -e "$model/model.json" ]; then continue; fi
            deepsft train --template "$template" --out "$model" --minutes "$MINUTES" --resume </dev/null || failed=1
        done
        exit $failed
    }
    ;;
track)
    mkdir -p "$OUT"
    ours "$VIDEOS" | {
        failed=0
        while IFS= read -r video; do
            track=$OUT/$(basename "$video")
            # A video with damaged frames is not tracked again: ffmpeg will complain each time.
            if [ -e "$track/track.json" ] && ! grep ended_early "$track/track.json" | grep -qv ffmpeg; then continue; fi
            deepsft track --model "$MODEL" ${CAMERA:+--camera "$CAMERA"} --out "$track" "$video" </dev/null || failed=1
        done
        exit $failed
    }
    ;;
*)
    echo "job.sh: unknown kind of job: $kind" >&2
    exit 2
    ;;
esac
