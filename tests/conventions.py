"""conventions.py IN.bvh STYLE OUT.bvh [EVERY [REST MOTION]]: the motion of IN.bvh, of joints as CMU or the kit name them, by the
joints of another convention: names, order, rest pose, units, up axis, additional joints and joints left out. Where a joint is in a
pose does not change but for units and axes: that is what the tests compare. REST and MOTION name the axes of the rest pose and of the
motion; where they differ, the root turns one into the other.
SPDX-License-Identifier: GPL-3.0-or-later"""
import math
import re
import sys


# ---- rotations, as rows of 3 x 3 ----

def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def apply(a, x):
    return [sum(a[i][k] * x[k] for k in range(3)) for i in range(3)]


def transpose(a):
    return [list(row) for row in zip(*a)]


def about(axis, degrees):
    c, s, k = math.cos(math.radians(degrees)), math.sin(math.radians(degrees)), "XYZ".index(axis)
    m = [[float(i == j) for j in range(3)] for i in range(3)]
    i, j = (k + 1) % 3, (k + 2) % 3
    m[i][i] = m[j][j] = c
    m[i][j], m[j][i] = -s, s
    return m


def between(a, b):
    """The smallest rotation from direction a to direction b."""
    a, b = unit(a), unit(b)
    v = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    c = sum(x * y for x, y in zip(a, b))
    k = [[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]]
    kk = product(k, k)
    return [[float(i == j) + k[i][j] + kk[i][j] / (1 + c) for j in range(3)] for i in range(3)]


def unit(a):
    n = math.sqrt(sum(x * x for x in a))
    return [x / n for x in a]


def angles(m):
    """Degrees about Z, X, Y with m = Z X Y."""
    x = math.asin(max(-1, min(1, m[2][1])))
    return [math.degrees(t) for t in (math.atan2(-m[0][1], m[1][1]), x, math.atan2(-m[2][0], m[2][2]))]


IDENTITY = [[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]]


class Joint:
    def __init__(self, name, parent, offset, source=None):
        self.name, self.parent, self.offset, self.source, self.channels = name, parent, offset, source, []


def read(path):
    """Joints, and the turn and place of each in each frame."""
    text = open(path).read()
    head, motion = text.split("MOTION")
    joints, stack, at = [], [], None
    for line in head.split("\n"):
        w = line.split()
        if not w: continue
        if w[0] in ("ROOT", "JOINT", "End"):
            at = Joint(w[1] if w[0] != "End" else None, stack[-1] if stack else None, None)
            joints.append(at)
        elif w[0] == "{": stack.append(at)
        elif w[0] == "}": stack.pop()
        elif w[0] == "OFFSET": at.offset = [float(x) for x in w[1:4]]
        elif w[0] == "CHANNELS": at.channels = w[2:]
    lines = [l for l in motion.split("\n") if l.strip()]
    rows = [[float(x) for x in l.split()] for l in lines[2:]]
    return joints, rows, float(lines[1].split()[-1])


def pose(joints, row):
    turns, places, i = {}, {}, 0
    for j in joints:
        m, shift = IDENTITY, [0.0, 0, 0]
        for c in j.channels:
            if c.endswith("rotation"): m = product(m, about(c[0], row[i]))
            else: shift["XYZ".index(c[0])] = row[i]
            i += 1
        up = j.parent
        turns[j] = product(turns[up], m) if up else m
        local = [a + b for a, b in zip(j.offset, shift)]
        places[j] = [a + b for a, b in zip(places[up], apply(turns[up], local))] if up else local
    return turns, places


# ---- conventions: name, parent, source; a number for the source puts the joint on the way from the parent to that joint ----

def fingers(style, side, hand):
    out = []
    for f, finger in enumerate(("thumb", "index", "middle", "ring", "pinky")):
        up = hand
        for k in range(1, 5 if style == "mixamo" else 4):
            name = {"mixamo": "%sHand%s%d" % (side, finger.capitalize(), k), "unreal": "%s_%02d_%s" % (finger, k, side),
                    "makehuman": "finger%d-%d.%s" % (f + 1, k, side),
                    "rigify": "DEF-%s.%02d.%s" % ("thumb" if f == 0 else "f_" + finger, k, side)}[style]
            out.append((name, up, ("finger", f, k)))
            up = name
    return out


def mixamo():
    t = [("Hips", None, "Hips"), ("Spine", "Hips", "LowerBack"), ("Spine1", "Spine", "Spine"), ("Spine2", "Spine1", "Spine1"),
         ("Neck", "Spine2", "Neck"), ("Head", "Neck", "Head"), ("HeadTop_End", "Head", ("end", 0))]
    for side in ("Left", "Right"):
        t += [(side + "Shoulder", "Spine2", side + "Shoulder"), (side + "Arm", side + "Shoulder", side + "Arm"),
              (side + "ForeArm", side + "Arm", side + "ForeArm"), (side + "Hand", side + "ForeArm", side + "Hand")]
        t += fingers("mixamo", side, side + "Hand")
    for side in ("Left", "Right"):
        t += [(side + "UpLeg", "Hips", side + "UpLeg"), (side + "Leg", side + "UpLeg", side + "Leg"),
              (side + "Foot", side + "Leg", side + "Foot"), (side + "ToeBase", side + "Foot", side + "ToeBase"),
              (side + "Toe_End", side + "ToeBase", ("end", 0))]
    return [("mixamorig:" + n, p and "mixamorig:" + p, s) for n, p, s in t]


def unreal():
    t = [("root", None, None), ("pelvis", "root", "Hips"), ("spine_01", "pelvis", "LowerBack"), ("spine_02", "spine_01", "Spine"),
         ("spine_03", "spine_02", "Spine1")]
    for side, s in (("Left", "l"), ("Right", "r")):
        t += [("clavicle_" + s, "spine_03", side + "Shoulder"), ("upperarm_" + s, "clavicle_" + s, side + "Arm"),
              ("lowerarm_" + s, "upperarm_" + s, side + "ForeArm"), ("hand_" + s, "lowerarm_" + s, side + "Hand")]
        t += fingers("unreal", s, "hand_" + s)
        t += [("lowerarm_twist_01_" + s, "lowerarm_" + s, ("way", side + "Hand")), ("upperarm_twist_01_" + s, "upperarm_" + s, ("way", side + "ForeArm"))]
    t += [("neck_01", "spine_03", "Neck"), ("head", "neck_01", "Head")]
    for side, s in (("Left", "l"), ("Right", "r")):
        t += [("thigh_" + s, "pelvis", side + "UpLeg"), ("calf_" + s, "thigh_" + s, side + "Leg"), ("calf_twist_01_" + s, "calf_" + s, ("way", side + "Foot")),
              ("foot_" + s, "calf_" + s, side + "Foot"), ("ball_" + s, "foot_" + s, side + "ToeBase"), ("thigh_twist_01_" + s, "thigh_" + s, ("way", side + "Leg"))]
    t += [("ik_foot_root", "root", None), ("ik_foot_l", "ik_foot_root", None), ("ik_foot_r", "ik_foot_root", None),
          ("ik_hand_root", "root", None), ("ik_hand_gun", "ik_hand_root", None), ("ik_hand_l", "ik_hand_gun", None), ("ik_hand_r", "ik_hand_gun", None)]
    return t


def makehuman():
    t = [("root", None, "Hips"), ("spine05", "root", "LowerBack"), ("spine04", "spine05", ("way", "Spine")), ("spine03", "spine04", "Spine"),
         ("spine02", "spine03", "Spine1"), ("spine01", "spine02", ("way", "Neck"))]
    for side, s in (("Left", "L"), ("Right", "R")):
        t += [("clavicle." + s, "spine01", side + "Shoulder"), ("shoulder01." + s, "clavicle." + s, ("way", side + "Arm")),
              ("upperarm01." + s, "shoulder01." + s, side + "Arm"), ("upperarm02." + s, "upperarm01." + s, ("way", side + "ForeArm")),
              ("lowerarm01." + s, "upperarm02." + s, side + "ForeArm"), ("lowerarm02." + s, "lowerarm01." + s, ("way", side + "Hand")),
              ("wrist." + s, "lowerarm02." + s, side + "Hand")]
        t += fingers("makehuman", s, "wrist." + s)
    t += [("neck01", "spine01", "Neck"), ("neck02", "neck01", "Neck1"), ("neck03", "neck02", ("way", "Head")), ("head", "neck03", "Head")]
    for side, s in (("Left", "L"), ("Right", "R")):
        t += [("pelvis." + s, "root", ("way", side + "UpLeg")), ("upperleg01." + s, "pelvis." + s, side + "UpLeg"),
              ("upperleg02." + s, "upperleg01." + s, ("way", side + "Leg")), ("lowerleg01." + s, "upperleg02." + s, side + "Leg"),
              ("lowerleg02." + s, "lowerleg01." + s, ("way", side + "Foot")), ("foot." + s, "lowerleg02." + s, side + "Foot"),
              ("toe1-1." + s, "foot." + s, side + "ToeBase"), ("toe2-1." + s, "foot." + s, side + "ToeBase")]
    return t


def rigify():
    t = [("DEF-spine", None, "Hips"), ("DEF-spine.001", "DEF-spine", "LowerBack"), ("DEF-spine.002", "DEF-spine.001", "Spine"),
         ("DEF-spine.003", "DEF-spine.002", "Spine1"), ("DEF-spine.004", "DEF-spine.003", "Neck"), ("DEF-spine.005", "DEF-spine.004", "Neck1"),
         ("DEF-spine.006", "DEF-spine.005", "Head")]
    for side, s in (("Left", "L"), ("Right", "R")):
        t += [("DEF-shoulder." + s, "DEF-spine.003", side + "Shoulder"), ("DEF-upper_arm." + s, "DEF-shoulder." + s, side + "Arm"),
              ("DEF-upper_arm." + s + ".001", "DEF-upper_arm." + s, ("way", side + "ForeArm")), ("DEF-forearm." + s, "DEF-upper_arm." + s + ".001", side + "ForeArm"),
              ("DEF-forearm." + s + ".001", "DEF-forearm." + s, ("way", side + "Hand")), ("DEF-hand." + s, "DEF-forearm." + s + ".001", side + "Hand")]
        t += fingers("rigify", s, "DEF-hand." + s)
        t += [("DEF-breast." + s, "DEF-spine.003", ("way", side + "Arm"))]
    for side, s in (("Left", "L"), ("Right", "R")):
        t += [("DEF-pelvis." + s, "DEF-spine", None), ("DEF-thigh." + s, "DEF-spine", side + "UpLeg"), ("DEF-thigh." + s + ".001", "DEF-thigh." + s, ("way", side + "Leg")),
              ("DEF-shin." + s, "DEF-thigh." + s + ".001", side + "Leg"), ("DEF-shin." + s + ".001", "DEF-shin." + s, ("way", side + "Foot")),
              ("DEF-foot." + s, "DEF-shin." + s + ".001", side + "Foot"), ("DEF-toe." + s, "DEF-foot." + s, side + "ToeBase")]
    return t


def metarig():
    t = [(n[4:], p and p[4:], s) for n, p, s in rigify() if not n.endswith(".001") or n == "DEF-spine.001"]
    return [(n, p[:-4] if p and p.endswith(".001") and p != "spine.001" else p, s) for n, p, s in t]


def asf():
    """The names of CMU's own files."""
    t = [("root", None, "Hips")]
    for side, s in (("Left", "l"), ("Right", "r")):
        t += [(s + "hipjoint", "root", None), (s + "femur", s + "hipjoint", side + "UpLeg"), (s + "tibia", s + "femur", side + "Leg"), (s + "foot", s + "tibia", side + "Foot"), (s + "toes", s + "foot", side + "ToeBase")]
    t += [("lowerback", "root", "LowerBack"), ("upperback", "lowerback", "Spine"), ("thorax", "upperback", "Spine1"), ("lowerneck", "thorax", "Neck"), ("upperneck", "lowerneck", "Neck1"), ("head", "upperneck", "Head")]
    for side, s in (("Left", "l"), ("Right", "r")):
        t += [(s + "clavicle", "thorax", side + "Shoulder"), (s + "humerus", s + "clavicle", side + "Arm"), (s + "radius", s + "humerus", side + "ForeArm"),
              (s + "wrist", s + "radius", side + "Hand"), (s + "hand", s + "wrist", ("finger", 2, 1)), (s + "fingers", s + "hand", ("finger", 1, 1)), (s + "thumb", s + "wrist", ("finger", 0, 1))]
    return t


def few():
    """Fifteen joints: no clavicles, one joint of the spine, no hands, no toes."""
    t = [("hip", None, "Hips"), ("abdomen", "hip", "Spine"), ("head", "abdomen", "Head")]
    for side, s in (("Left", "l"), ("Right", "r")):
        t += [(s + "Shldr", "abdomen", side + "Arm"), (s + "ForeArm", s + "Shldr", side + "ForeArm"), (s + "Hand", s + "ForeArm", side + "Hand"),
              (s + "Thigh", "hip", side + "UpLeg"), (s + "Shin", s + "Thigh", side + "Leg"), (s + "Foot", s + "Shin", side + "Foot")]
    return t


def humanik():
    """As VRM and Unity name them."""
    t = [("hips", None, "Hips"), ("spine", "hips", "LowerBack"), ("chest", "spine", "Spine"), ("upperChest", "chest", "Spine1"), ("neck", "upperChest", "Neck"), ("head", "neck", "Head")]
    for side in ("Left", "Right"):
        s = side.lower()
        t += [(s + "Shoulder", "upperChest", side + "Shoulder"), (s + "UpperArm", s + "Shoulder", side + "Arm"), (s + "LowerArm", s + "UpperArm", side + "ForeArm"), (s + "Hand", s + "LowerArm", side + "Hand"),
              (s + "UpperLeg", "hips", side + "UpLeg"), (s + "LowerLeg", s + "UpperLeg", side + "Leg"), (s + "Foot", s + "LowerLeg", side + "Foot"), (s + "Toes", s + "Foot", side + "ToeBase")]
    return t


def body(hips, spine, neck, limb, names, roots=(), clavicle=True):
    """A table from the names of the chains; limb(side, name) makes the names of the limbs, from clavicle to toes."""
    t, up = [], None
    for n in roots: t, up = t + [(n, up, None)], n
    for n, s in zip(hips, ("Hips", "Hips")): t, up = t + [(n, up, s)], n
    top = hip = up
    for n, s in zip(spine, ("LowerBack", "Spine", "Spine1")): t, top = t + [(n, top, s)], n
    up = top
    for n, s in zip(neck, ("Neck", "Head")[-len(neck):]): t, up = t + [(n, up, s)], n
    for side in ("Left", "Right"):
        arm, leg = ("Shoulder", "Arm", "ForeArm", "Hand"), ("UpLeg", "Leg", "Foot", "ToeBase")
        for first, parts, words in ((top, arm if clavicle else arm[1:], names[:-4]), (hip, leg, names[-4:])):
            up = first
            for part, word in zip(parts, words):
                if word: t, up = t + [(limb(side, word), up, side + part)], limb(side, word)
    return t


def prefixed(prefix, table):
    return [(prefix + n, p and prefix + p, s) for n, p, s in table]


def biped():
    """The pelvis below a root of the same place; clavicles hang from the neck, thighs from the spine."""
    t = body(["", " Pelvis"], [" Spine", " Spine1", " Spine2"], [" Neck", " Head"], lambda side, n: " %s %s" % (side[0], n), ["Clavicle", "UpperArm", "Forearm", "Hand", "Thigh", "Calf", "Foot", "Toe0"])
    other = {" L Clavicle": " Neck", " R Clavicle": " Neck", " L Thigh": " Spine", " R Thigh": " Spine"}
    return [("Bip01" + n, None if p is None else "Bip01" + other.get(n, p), s) for n, p, s in t]


def motive():
    return prefixed("Skeleton 001:", body(["Hip"], ["Ab", "Chest"], ["Neck", "Head"], lambda side, n: side[0] + n, ["Shoulder", "UArm", "FArm", "Hand", "Thigh", "Shin", "Foot", "Toe"]))


def kinect():
    t = body(["HipCenter"], ["Spine"], ["ShoulderCenter", "Head"], lambda side, n: n + side, ["Shoulder", "Elbow", "Wrist", "Hip", "Knee", "Ankle", "Foot"], clavicle=False)
    return t + [("Hand" + side, "Wrist" + side, ("finger", 1, 1)) for side in ("Left", "Right")]


def smpl():
    t = body(["Pelvis"], ["Spine1", "Spine2", "Spine3"], ["Neck", "Head"], lambda side, n: "%s_%s" % (side[0], n), ["Collar", "Shoulder", "Elbow", "Wrist", "Hip", "Knee", "Ankle", "Foot"])
    return prefixed("m_avg_", t + [(s + "_Hand", s + "_Wrist", ("finger", 1, 1)) for s in "LR"])


def xsens():
    return body(["Pelvis"], ["L5", "L3", "T8"], ["Neck", "Head"], lambda side, n: side + n, ["Shoulder", "UpperArm", "ForeArm", "Hand", "UpperLeg", "LowerLeg", "Foot", "Toe"])


def maya():
    t = body(["Root_M"], ["Spine1_M", "Spine2_M", "Chest_M"], ["Neck_M", "Head_M"], lambda side, n: "%s_%s" % (n, side[0]), ["Scapula", "Shoulder", "Elbow", "Wrist", "Hip", "Knee", "Ankle", "Toes"])
    return [(n + "_jnt", p and p + "_jnt", s) for n, p, s in t]


def second_life():
    return prefixed("m", body(["Pelvis"], ["Torso", "Chest"], ["Neck", "Head"], lambda side, n: n + side, ["Collar", "Shoulder", "Elbow", "Wrist", "Hip", "Knee", "Ankle", "Foot"]))


def roblox():
    return body(["LowerTorso"], ["UpperTorso"], ["Head"], lambda side, n: side + n, ["UpperArm", "LowerArm", "Hand", "UpperLeg", "LowerLeg", "Foot", None], ["HumanoidRootPart"], clavicle=False)


def numbered():
    """Limbs by numbers alone."""
    return body(["hips"], ["spine"], ["neck", "head"], lambda side, n: "%s_%s" % (n, side[0].lower()), ["shoulder", "arm_1", "arm_2", "arm_3", "leg_1", "leg_2", "leg_3", "leg_4"])


def cesium():
    """As the glTF sample CesiumMan: numbers of limbs with gaps, and backwards on the left."""
    left, right = ["arm_joint_L__%d_" % k for k in (4, 3, 2)], ["arm_joint_R", "arm_joint_R__2_", "arm_joint_R__3_"]
    t = [("Skeleton_torso_joint_1", None, "Hips"), ("Skeleton_torso_joint_2", "Skeleton_torso_joint_1", "LowerBack"), ("torso_joint_3", "Skeleton_torso_joint_2", "Spine1"),
         ("Skeleton_neck_joint_1", "torso_joint_3", "Neck"), ("Skeleton_neck_joint_2", "Skeleton_neck_joint_1", "Head")]
    for side, arm in (("Left", left), ("Right", right)):
        for first, names, parts in (("torso_joint_3", ["Skeleton_" + n for n in arm], ("Arm", "ForeArm", "Hand")),
                                    ("Skeleton_torso_joint_1", ["leg_joint_%s_%d" % (side[0], k) for k in (1, 2, 3, 5)], ("UpLeg", "Leg", "Foot", "ToeBase"))):
            for name, part in zip(names, parts): t, first = t + [(name, first, side + part)], name
    return t


def quaternius():
    """The end of the arm is no word for a hand."""
    return body(["Body", "Hips"], ["Abdomen", "Torso"], ["Neck", "Head"], lambda side, n: "%s.%s" % (n, side[0]), ["Shoulder", "UpperArm", "LowerArm", "Grip", "UpperLeg", "LowerLeg", "Foot", None], ["Bone"])


def nameless():
    t = prefixed("", humanik())
    number = {n: "joint%d" % i for i, (n, _, _) in enumerate(t)}
    return [(number[n], p and number[p], s) for n, p, s in t]


# table, arms of the rest pose in degrees below horizontal, scale, whether z is up
STYLES = {"mixamo": (mixamo, 0, 1.0, False), "unreal": (unreal, 50, 1.0, True), "makehuman": (makehuman, 40, 0.1, False), "rigify": (rigify, 45, 0.01, True),
          "metarig": (metarig, 30, 0.01, False), "asf": (asf, 0, 1 / 0.45, False), "few": (few, 0, 1.0, False), "vrm": (humanik, 0, 0.01, False),
          "unreal-y": (unreal, 50, 1.0, False), "rigify-y": (rigify, 45, 0.01, False), "biped": (biped, 0, 1.0, False), "motive": (motive, 0, 100, False),
          "kinect": (kinect, 10, 0.01, False), "smpl": (smpl, 0, 0.01, False), "xsens": (xsens, 88, 1.0, False), "maya": (maya, 45, 1.0, False), "roblox": (roblox, 85, 2.54, False),
          "second-life": (second_life, 0, 0.01, False), "numbered": (numbered, 30, 1.0, False), "quaternius": (quaternius, -10, 1.0, False), "nameless": (nameless, 20, 1.0, False),
          "cesium": (cesium, 60, 1.0, False)}
LIMBS = {s + n: s + c for s in ("Left", "Right") for n, c in (("Arm", "ForeArm"), ("ForeArm", "Hand"), ("UpLeg", "Leg"), ("Leg", "Foot"))}


def rest_turns(source, arms):
    """B of each source joint: what turns its rest pose into that of the convention. Legs straight down, arms out."""
    b, below = {}, {j.name: j for j in source if j.name}
    for j in source:
        b[j] = b[j.parent] if j.parent else IDENTITY
        if j.name in LIMBS:
            side = 1 if j.name.startswith("Left") else -1
            d = [side * math.cos(math.radians(arms)), -math.sin(math.radians(arms)), 0.0] if "Arm" in j.name else [0.0, -1.0, 0.0]
            b[j] = between(below[LIMBS[j.name]].offset, d)
        elif j.name and re.match("(Left|Right)Foot$", j.name): b[j] = IDENTITY
    return b


# up and ahead: the rotation of a body that has y up and looks along z
AXES = {"yz": IDENTITY, "yx": about("Y", 90), "y-x": about("Y", -90), "y-z": about("Y", 180), "z-y": about("X", 90),
        "zx": product(about("Z", 90), about("X", 90)), "zy": product(about("Z", 180), about("X", 90)), "xz": about("Z", -90)}


def convert(path, style, out, every, rest=None, motion=None):
    table, arms, scale, zup = STYLES[style]
    source, rows, step = read(path)
    named = {j.name: j for j in source if j.name}
    b = rest_turns(source, arms)
    tip = {j.parent: j for j in source if not j.name}
    world = {j: None for j in source}
    for j in source: world[j] = [x + y for x, y in zip(world[j.parent], apply(b[j.parent], j.offset))] if j.parent else [0.0, 0, 0]
    up = AXES[rest or ("z-y" if zup else "yz")]
    joints, of = [], {}
    for name, parent, src in table():
        j = Joint(name, of.get(parent), None, None)
        up_at = j.parent.at if j.parent else [0.0, 0, 0]
        if isinstance(src, str): j.source, j.at = named[src], world[named[src]]
        else:
            j.source = j.parent.source if j.parent else None
            if src is None: j.at = up_at
            elif src[0] == "way": j.at = [(x + y) / 2 for x, y in zip(up_at, world[named[src[1]]])]
            elif src[0] == "end": j.at = [x + 0.1 * y for x, y in zip(up_at, (0, 1, 0) if "Head" in name else (0, 0, 1))]
            else: j.at = [x + y for x, y in zip(up_at, apply(b[j.source], finger_offset(named, j.source, src)))]
        j.offset = apply(up, [scale * (x - y) for x, y in zip(j.at, up_at)])
        joints.append(j)
        of[name] = j
    write(out, joints, source, b, rows[::every], step * every, scale, up, AXES[motion] if motion else up)


def finger_offset(named, hand, src):
    side = "Left" if hand.name.startswith("Left") else "Right"
    d = [x for x in named[LIMBS_BACK[side + "Hand"]].offset]
    size = math.sqrt(sum(x * x for x in named[side + "Hand"].offset)) * 0.12
    d = unit(named[side + "Hand"].offset)
    return [size * x + (0.3 * size * (src[1] - 2) if k == 2 and src[2] == 1 else 0) for k, x in enumerate(d)]


LIMBS_BACK = {c: n for n, c in LIMBS.items()}


def write(path, joints, source, b, rows, step, scale, up, world):
    children = {j: [c for c in joints if c.parent is j] for j in joints}
    order, out = [], ["HIERARCHY"]

    def put(j, depth):
        pad = "  " * depth
        order.append(j)
        out.append("%s%s %s" % (pad, "JOINT" if depth else "ROOT", j.name))
        out.append(pad + "{")
        out.append("%s  OFFSET %.6f %.6f %.6f" % ((pad,) + tuple(j.offset)))
        out.append(pad + ("  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation" if not j.parent
                          else "  CHANNELS 3 Zrotation Xrotation Yrotation"))
        for c in children[j]: put(c, depth + 1)
        if not children[j]: out.append("%s  End Site\n%s  {\n%s    OFFSET 0 0 0\n%s  }" % (pad, pad, pad, pad))
        out.append(pad + "}")

    put(joints[0], 0)
    out += ["MOTION", "Frames: %d" % len(rows), "Frame Time: %.6f" % step]
    back = transpose(up)
    for row in rows:
        turns, places = pose(source, row)
        hips = next(j for j in source if not j.parent)
        line = []
        for j in order:
            turn = product(turns[j.source], transpose(b[j.source])) if j.source else IDENTITY
            if j.source is None and j.parent is None: turn = turns[hips]
            j.turn = product(product(world, turn), back)
            if not j.parent:
                line += ["%.6f" % x for x in apply(world, [scale * x for x in places[hips]])]
                local = j.turn
            else: local = product(transpose(j.parent.turn), j.turn)
            line += ["%.6f" % x for x in angles(local)]
        out.append(" ".join(line))
    open(path, "w").write("\n".join(out) + "\n")


# a figure of sticks with CMU's names, in metres: joint, parent, OFFSET
STICKS = [("Hips", None, (0, 0, 0)), ("LowerBack", "Hips", (0, 0.1, 0)), ("Spine", "LowerBack", (0, 0.12, 0)), ("Spine1", "Spine", (0, 0.12, 0)), ("Neck", "Spine1", (0, 0.15, 0)),
          ("Neck1", "Neck", (0, 0.05, 0)), ("Head", "Neck1", (0, 0.05, 0))]
for _side, _x in (("Left", 1), ("Right", -1)):
    STICKS += [(_side + n, _side + p if p in ("Shoulder", "Arm", "ForeArm", "UpLeg", "Leg", "Foot") else p, (_x * a, b, c)) for n, p, (a, b, c) in (
        ("Shoulder", "Spine1", (0.03, 0.1, 0)), ("Arm", "Shoulder", (0.15, 0, 0)), ("ForeArm", "Arm", (0.28, 0, 0)), ("Hand", "ForeArm", (0.25, 0, 0)),
        ("UpLeg", "Hips", (0.1, -0.05, 0)), ("Leg", "UpLeg", (0, -0.42, 0)), ("Foot", "Leg", (0, -0.4, 0)), ("ToeBase", "Foot", (0, -0.06, 0.14)))]
MOVES = {"LowerBack": 30, "Neck": 25, "Head": 20, "Shoulder": 10, "Arm": 70, "ForeArm": 60, "Hand": 30, "UpLeg": 50, "Leg": 40, "Foot": 20}


def sticks(path, frames, seed):
    """Poses at random of joints that every skeleton has: of a spine, the lowest joint turns."""
    import random
    r, out, joints = random.Random(seed), [], {}
    for n, p, x in STICKS:
        joints[n] = Joint(n, joints.get(p), x)
        joints[n].source, joints[n].channels = joints[n], ["Xposition", "Yposition", "Zposition"][:0 if p else 3] + ["Zrotation", "Xrotation", "Yrotation"]
    for _ in range(frames):
        row = [r.uniform(-1, 1), 1 + r.uniform(0, 0.2), r.uniform(-1, 1)]
        for n, _, _ in STICKS:
            most = MOVES.get(re.sub("^(Left|Right)", "", n), 10 if n == "Hips" else 0)
            row += [r.uniform(-most, most) for _ in range(3)]
        out.append(row)
    order = list(joints.values())
    write(path, order, order, {j: IDENTITY for j in order}, out, 1 / 30, 1.0, IDENTITY, IDENTITY)


if __name__ == "__main__":
    convert(sys.argv[1], sys.argv[2], sys.argv[3], int(sys.argv[4]) if len(sys.argv) > 4 else 1, *sys.argv[5:])
