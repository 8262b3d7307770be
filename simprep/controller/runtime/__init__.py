"""The controller at run time: locomotion without end, tasks, approaches."""
