"""What a motion is: the Motion class, editing, contacts, files, retargeting."""
