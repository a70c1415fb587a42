# SPDX-License-Identifier: Apache-2.0
"""Files of other programs, for the target `exchange`."""

MARKUPS = """{"@schema": "markups-schema-v1.0.3.json#", "markups": [{"type": "Fiducial", "coordinateSystem": "RAS",
 "coordinateUnits": "mm", "controlPoints": [{"id": "1", "label": "head", "position": [1.5, -2, 3e1],
 "positionStatus": "defined"}, {"label": "neck", "position": [4, 5, 6]}]}]}
"""
FCSV = """# Markups fiducial file version = 4.11
# CoordinateSystem = LPS
# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID
1,10,-20,30,0,0,0,1,1,1,0,distal-1,,
2,40,50,60,0,0,0,1,1,1,0,"a ""b"", c",,
"""
TRANSFORM = """#Insight Transform File V1.0
#Transform 0
Transform: %s
Parameters: %s
FixedParameters: 0 0 0
"""
OBJ = "# SPACE=RAS\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1/1 2/1/1 4//1\nf -4 -1 -2\nf 2 3 4\n"
PLASTIMATCH = """49.5 59.5
0 1 0 0
0 0 -0.8 0
-0.0006666666666666666 0 0 0.6666666666666666
1000
1500
-1 0 0
Extrinsic
0 1 0 0
0 0 -1 0
-1 0 0 1000
0 0 0 1
Intrinsic
1 0 0 0
0 0.8 0 0
0 0 0.0006666666666666666 0
"""
MAYA = "0,0,600\n90,-2.5,0\n3.9,4.1,-632.5\n321,201,-1000\n0.1,640,480\n"
TRIAL = """# two bones
Version 1.2
mayaCam_csv Calibration/one.txt
CameraRootDir Frames\\one/
VolumeFile Volumes/rad_cropped.tif
VolumeFlip 0 1 0
VoxelSize 0.5 0.75 2
MeshFile Models/rad.stl
VolumeFile Volumes/mc3 cropped.tif
VolumeFlip 0 0 0
VoxelSize 1 1 1
MeshFile Models/mc3.stl
OptimizationOffsets 0.1 0.1 0.1 0.1 0.1 0.1
"""
RTK = """<?xml version="1.0"?>
<!DOCTYPE RTKGEOMETRY>
<RTKThreeDCircularGeometry version="3">
  <SourceToIsocenterDistance>1000</SourceToIsocenterDistance>
  <SourceToDetectorDistance>1500</SourceToDetectorDistance>
  <Projection>
    <GantryAngle>0</GantryAngle>
    <Matrix>-1500 0 0 0  0 -1500 0 0  0 0 1 -1000</Matrix>
  </Projection>
</RTKThreeDCircularGeometry>
"""


def seeds():
    texts = {
        "markups": "j" + MARKUPS,
        "fcsv": "f" + FCSV,
        "affine": "t" + TRANSFORM % ("AffineTransform_double_3_3", "0 -1 0 1 0 0 0 0 1 1 2 3"),
        "versor": "t" + TRANSFORM % ("VersorRigid3DTransform_double_3_3", "0 0 0.5 1 2 3"),
        "euler": "t" + TRANSFORM % ("Euler3DTransform_double_3_3", "0.1 0.2 0.3 1 2 3"),
        "obj": "o" + OBJ,
        "plastimatch": "p" + PLASTIMATCH,
        "rtk": "r" + RTK,
        "maya": "m" + MAYA,
        "trial": "a" + TRIAL,
    }
    return {name: text.encode() for name, text in texts.items()}
