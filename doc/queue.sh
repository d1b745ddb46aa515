#!/bin/sh
# Example of a job for the queue of SLURM: one run on four ranks, which comes back into the queue until it is done.
# The deck holds *RESTART, WRITE, OVERLAY. Five minutes before the end of its time the run gets SIGTERM, writes JOB.rst and
# ends with exit code 6. (Written after the manual of SLURM; the parts with mpirun were tried without a queue.)
#
# Several nodes: --nodes=2 and --ntasks-per-node; all must see the folder of the deck, rank 0 alone reads and writes there but for
# pieces of VTK. Without a queue a file with a line "name slots=4" for each node, and
#   mpirun --hostfile FILE -np 8 mpfe job.inp
# Nodes must be of one kind: a run whose ranks differ in a bit stops.
#
#SBATCH --job-name=plate
#SBATCH --nodes=1
#SBATCH --ntasks=4
#SBATCH --cpus-per-task=1
#SBATCH --time=12:00:00
#SBATCH --signal=TERM@300

job=plate
restart=
[ -f $job.rst ] && restart="--restart $job.rst"

# srun hands the signal on to the ranks. With mpirun give them time to end their increment, it kills them after a second else:
#   mpirun -np 4 --mca odls_base_sigkill_timeout 250 mpfe ...
srun mpfe $restart $job.inp
code=$?

[ $code -eq 6 ] && sbatch "$0"
exit $code
