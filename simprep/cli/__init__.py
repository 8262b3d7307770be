"""The command line: one thin file per command. Nothing heavy is imported before a command runs."""

import os

# before numpy is imported: its matrices here are small, and idle threads of BLAS that wait for work take the cores from
# simulations (half as much time again on two cores)
os.environ.setdefault("OMP_NUM_THREADS", "1")
