#!/bin/sh
# Example of a job for the queue of SLURM: one run on four ranks, which comes back into the queue until it is done.
# The deck holds *RESTART, WRITE, OVERLAY. Five minutes before the end of its time this script gets SIGUSR1 and hands it on; the
# run ends its increment, writes JOB.rst and JOB.continue, and ends with exit code 6. (The case S8 runs this script with mpirun in
# place of srun and without a queue.)
#
# mpirun hands SIGUSR1 on to the ranks, as srun does. SIGTERM it does not: it gives them a second, kills them then, and returns 1,
# whatever they return. What an increment takes less than a second for is saved even so: JOB.rst and JOB.continue are there.
#   mpirun -np 4 mpfe $restart $job.inp &
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
#SBATCH --signal=B:USR1@300

job=plate
restart=
[ -f $job.rst ] && restart="--restart $job.rst"

srun mpfe $restart $job.inp &
run=$!
trap 'kill -USR1 $run' USR1 TERM
wait $run
code=$?
while kill -0 $run 2>/dev/null; do        # a signal ends wait, not the run
  wait $run
  code=$?
done

[ -f $job.continue ] && sbatch "$0"
exit $code
