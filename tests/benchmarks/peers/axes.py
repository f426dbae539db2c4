"""A bare script for one kind of document: what a person writes who needs no more than principal axes.

    python axes.py LIST

It reads each cube in YAML that a list names, validates it, and prints its tensor, moments and axes about a
corner as JSON.
"""

import json
import sys
from pathlib import Path

import numpy as np
import yaml
from pydantic import BaseModel


class Body(BaseModel):
    """A cube."""

    shape: str
    side: float
    mass: float
    anchor: str | None = None


class Document(BaseModel):
    """What stands in a file."""

    name: str
    body: Body


for path in Path(sys.argv[1]).read_text().split():
    document = Document.model_validate(yaml.load(Path(path).read_text(), Loader=yaml.CSafeLoader))
    body = document.body
    centre = np.full(3, body.side / 2)
    central = np.eye(3) * body.mass * body.side**2 / 6
    tensor = central + body.mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    moments, vectors = np.linalg.eigh(tensor)
    result = {
        "name": document.name,
        "mass": body.mass,
        "center_of_mass": centre.tolist(),
        "tensor": tensor.tolist(),
        "tensor_com": central.tolist(),
        "moments": moments.tolist(),
        "axes": vectors.T.tolist(),
    }
    print(json.dumps(result))
