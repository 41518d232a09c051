from bumblebee.api.diagnosis import diagnose as diagnose
from bumblebee.api.diagnosis import gap as gap
from bumblebee.api.diagnosis import open_dataset as open_dataset
from bumblebee.api.diagnosis import plan as plan
from bumblebee.api.diagnosis import replay as replay
from bumblebee.api.motions import film as film
from bumblebee.api.motions import make_motion as make_motion
from bumblebee.api.motions import read_motions as read_motions
from bumblebee.api.motions import retarget as retarget
from bumblebee.api.policies import evaluate as evaluate
from bumblebee.api.policies import follow as follow
from bumblebee.api.policies import load_policy as load_policy
from bumblebee.api.training import train as train
from bumblebee.errors import BadInput as BadInput
from bumblebee.robot.facts import joint_names as joint_names

__version__: str
DISTRIBUTION: str
