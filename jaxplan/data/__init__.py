"""What a demonstration is: schema, shards on disk, checksums."""

from jaxplan.data.files import UnwritableError as UnwritableError
from jaxplan.data.files import check_writable as check_writable
from jaxplan.data.files import sha256 as sha256
from jaxplan.data.files import write_atomic as write_atomic
from jaxplan.data.files import write_npz as write_npz
from jaxplan.data.schema import IMAGE_SHAPE as IMAGE_SHAPE
from jaxplan.data.schema import NO_PATH as NO_PATH
from jaxplan.data.schema import PATH_POINTS as PATH_POINTS
from jaxplan.data.schema import TOGGLES as TOGGLES
from jaxplan.data.schema import DataError as DataError
from jaxplan.data.schema import Shard as Shard
from jaxplan.data.schema import as_shard as as_shard
from jaxplan.data.schema import concatenate as concatenate
from jaxplan.data.shards import MANIFEST as MANIFEST
from jaxplan.data.shards import missing_shards as missing_shards
from jaxplan.data.shards import read_demonstrations as read_demonstrations
from jaxplan.data.shards import read_manifest as read_manifest
from jaxplan.data.shards import read_shard as read_shard
from jaxplan.data.shards import save_manifest as save_manifest
from jaxplan.data.shards import shard_path as shard_path
from jaxplan.data.shards import verify as verify
from jaxplan.data.shards import write_manifest as write_manifest
from jaxplan.data.shards import write_shard as write_shard
