"""Joint names of common families of skeletons, written down apart from simprep's own recognition."""

from simprep.character import SIDES

PARTS = ("thigh", "shank", "foot", "toe", "collar", "upper_arm", "forearm", "hand")
_L, _R = ("Left", "Right"), ("L", "R")
_TABLE = {
    # family: root, spine joints, neck, head, side words, pattern, names of PARTS
    "mixamo": ("mixamorig:Hips", ("mixamorig:Spine", "mixamorig:Spine1", "mixamorig:Spine2", "mixamorig:Spine3"),
               "mixamorig:Neck", "mixamorig:Head", _L, "mixamorig:{s}{p}",
               ("UpLeg", "Leg", "Foot", "ToeBase", "Shoulder", "Arm", "ForeArm", "Hand")),
    "cmu": ("Hips", ("LowerBack", "Spine", "Spine1", "Spine2"), "Neck", "Head", _L, "{s}{p}",
            ("UpLeg", "Leg", "Foot", "ToeBase", "Shoulder", "Arm", "ForeArm", "Hand")),
    "lafan1": ("Hips", ("Spine", "Spine1", "Spine2", "Spine3"), "Neck", "Head", _L, "{s}{p}",
               ("UpLeg", "Leg", "Foot", "Toe", "Shoulder", "Arm", "ForeArm", "Hand")),
    "bandai": ("Hips", ("Spine", "Chest", "Chest1", "Chest2"), "Neck", "Head", _R, "{p}_{s}",
               ("UpperLeg", "LowerLeg", "Foot", "Toes", "Shoulder", "UpperArm", "LowerArm", "Hand")),
    "biped": ("Bip01_Pelvis", ("Bip01_Spine", "Bip01_Spine1", "Bip01_Spine2", "Bip01_Spine3"), "Bip01_Neck",
              "Bip01_Head", _R, "Bip01_{s}_{p}",
              ("Thigh", "Calf", "Foot", "Toe0", "Clavicle", "UpperArm", "Forearm", "Hand")),
    "poser": ("Hips", ("Abdomen", "Chest", "Chest1", "Chest2"), "Neck", "Head", _L, "{s}{p}",
              ("Hip", "Knee", "Ankle", "Toe", "Collar", "Shoulder", "Elbow", "Wrist")),
    "character_creator": ("CC_Base_Hip", ("CC_Base_Waist", "CC_Base_Spine01", "CC_Base_Spine02", "CC_Base_Spine03"),
                          "CC_Base_NeckTwist01", "CC_Base_Head", _R, "CC_Base_{s}_{p}",
                          ("Thigh", "Calf", "Foot", "ToeBase", "Clavicle", "Upperarm", "Forearm", "Hand")),
    "smpl": ("Pelvis", ("Spine1", "Spine2", "Spine3", "Spine4"), "Neck", "Head", _R, "{s}_{p}",
             ("Hip", "Knee", "Ankle", "Foot", "Collar", "Shoulder", "Elbow", "Wrist")),
    "daz": ("hip", ("abdomen", "chest", "chest1", "chest2"), "neck", "head", ("l", "r"), "{s}{p}",
            ("Thigh", "Shin", "Foot", "Toe", "Collar", "Shldr", "ForeArm", "Hand")),
}  # fmt: skip
FAMILIES = {
    family: {"hips": root, **{f"spine{n}": name for n, name in enumerate(spine)}, "neck": neck, "head": head,
             **{f"{side}_{part}": pattern.format(s=word, p=name)
                for side, word in zip(SIDES, words) for part, name in zip(PARTS, parts)}}
    for family, (root, spine, neck, head, words, pattern, parts) in _TABLE.items()
}  # fmt: skip
"""Family to {our role: its joint name}."""
RECOGNISED = tuple(name for name in FAMILIES if name != "daz")
