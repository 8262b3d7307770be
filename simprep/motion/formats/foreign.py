"""Motion files that are recognised but not read: what they are, for the message."""

from collections.abc import Collection

ROBOT = "valid: all keys of its format, and `simprep import --robot`"
SMPL = "`simprep import` and simprep.load_motion read it, if it has all joints and their place (poses, trans)"
_POSES = {"poses", "pose_body", "body_pose", "root_orient", "global_orient", "smpl_poses"}
_TRANSLATIONS = {"trans", "transl", "smpl_trans"}
_ROBOT_PARTS = {
    "joint_pos", "joint_vel", "body_pos_w", "body_quat_w", "root_pos", "root_rot", "dof_pos", "root_trans_offset", "dof"
}  # fmt: skip


def npz_kind(entries: Collection[str]) -> str | None:
    """Kind of an .npz whose entries have these names; None if unknown."""
    names = set(entries)
    if names & _POSES and names & (_TRANSLATIONS | {"betas"}):
        return f"an AMASS/SMPL motion ({_shown(names & (_POSES | _TRANSLATIONS | {'betas'}))}): {SMPL}"
    if "betas" in names:
        return "an AMASS/SMPL body shape without a motion; valid: a motion file"
    if {"joint_pos", "body_pos_w"} <= names:
        return f"a robot's motion of BeyondMimic, mjlab or holosoma (joint_pos, body_pos_w): {ROBOT}"
    if {"root_pos", "root_rot", "dof_pos"} <= names:
        return f"a robot's motion of GMR (root_pos, root_rot, dof_pos): {ROBOT}"
    if {"root_trans_offset", "dof"} <= names:
        return f"a robot's motion of ASAP or PBHC (root_trans_offset, dof): {ROBOT}"
    if {"positions", "joint_names", "fps"} <= names:
        return "joint positions (positions, joint_names, fps), which `simprep duel import` reads, of two people"
    if "qpos" in names:
        return f"a robot's motion of holosoma or OmniRetarget (qpos without simprep's header): {ROBOT}"
    if parts := names & _ROBOT_PARTS:
        return f"parts of a robot's motion ({_shown(parts)}): {ROBOT}, as docs/formats.md lists them"
    return None


def _shown(names: Collection[str]) -> str:
    return ", ".join(sorted(names))
