#!/usr/bin/env bash
# The bricks of a plan as plain Slurm arrays, without Snakemake: a sweep starts after the one before.
#
#     bash houdini_free_examples/bricks/slurm_array.sh plan/ surface.vdb [SWEEPS]
set -euo pipefail
plan=$1 out=$2 sweeps=${3:-3} covol=${COVOL:-covol} after=
last=$(( $(python3 -c "import json,sys; print(len(json.load(open(sys.argv[1]))['bricks']))" "$plan/plan.json") - 1 ))
for sweep in $(seq "$sweeps"); do
  after=$(sbatch --parsable --job-name="covol-$sweep" --array="0-$last" ${after:+--dependency=afterok:$after} \
    --wrap "$covol brick run $plan \$SLURM_ARRAY_TASK_ID --sweep $sweep --threads \${SLURM_CPUS_PER_TASK:-1}")
done
sbatch --parsable --job-name=covol-join --dependency="afterok:$after" --wrap "$covol brick join $plan -o $out"
