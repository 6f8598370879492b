#!/usr/bin/env bash
# State of a Slurm job, for `snakemake --cluster-status`: without it Snakemake would wait forever for a job that was
# killed.
state=$(scontrol show job "$1" 2>/dev/null | sed -n 's/.*JobState=\([A-Z_]*\).*/\1/p')
[[ -n $state ]] || state=$(sacct -j "$1" -X -n -o State 2>/dev/null | awk '{print $1; exit}')
case $state in
  COMPLETED) echo success ;;
  PENDING|RUNNING|COMPLETING|CONFIGURING|SUSPENDED|REQUEUED|RESIZING) echo running ;;
  *) echo failed ;;
esac
