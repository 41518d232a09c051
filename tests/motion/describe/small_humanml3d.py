"""A HumanML3D of three motions, as it is published and unpacked."""

import zipfile
from pathlib import Path

INDEX = """source_path,start_frame,end_frame,new_name
./pose_data/CMU/01/01_01_poses.npy,200,400,000000.npy
./pose_data/CMU/01/01_01_poses.npy,0,100,000001.npy
./pose_data/Eyes_Japan_Dataset/aita/turn-03-look at-aita_poses.npy,20,120,000002.npy
./pose_data/humanact12/humanact12/P11G01R02F1812T1847A0402.npy,0,-1,000003.npy
./pose_data/CMU/18_19_rory/18_13_poses.npy,0,40,000004.npy
./pose_data/CMU/18_19_Justin/18_13_poses.npy,0,40,000005.npy
"""
TEXTS = {
    "000000": "a person kicks left#a/DET person/NOUN kick/VERB left/ADV#0.0#0.0\n"
    "they wait#they/PRON wait/VERB#2.0#3.5\n",
    "M000000": "a person kicks right#a/DET person/NOUN kick/VERB right/ADV#0.0#0.0\n",
    "000001": "a person stands#a/DET person/NOUN stand/VERB#nan#nan\n",
    "M000001": "a person stands#a/DET person/NOUN stand/VERB#0.0#0.0\n",
    "000002": "a person looks around#a/DET person/NOUN look/VERB around/ADV#1.0#10.0\n",
    "000003": "a person sits#a/DET person/NOUN sit/VERB#0.0#0.0\n",
    "000004": "a person falls#a/DET person/NOUN fall/VERB#0.0#0.0\n",
    "000005": "a person sings#a/DET person/NOUN sing/VERB#0.0#0.0\n",
}


def put_humanml3d(folder: Path, index: str = INDEX, texts: dict[str, str] | None = None, packed: bool = True) -> Path:
    """The data set in a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "index.csv").write_text(index)
    texts = TEXTS if texts is None else texts
    if packed:
        with zipfile.ZipFile(folder / "texts.zip", "w", zipfile.ZIP_DEFLATED) as archive:
            for name, text in texts.items():
                archive.writestr(f"texts/{name}.txt", text)
    else:
        (folder / "texts").mkdir()
        for name, text in texts.items():
            (folder / "texts" / f"{name}.txt").write_text(text)
    return folder
