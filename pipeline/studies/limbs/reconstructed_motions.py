"""Reconstructions of whole skeletons before several cameras, and their errors: what figure 4 of park2011 shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd


@dataclass(frozen=True)
class Motions:
    """Reconstructions of N clips from C cameras.

    Attributes
    ----------
    cameras : (C,) text
    stretch : (N,) int
        Of the data set.
    truth : (N, F, 15, 3)
        mm.
    positions : (N, C, F, 15, 3)
        mm.
    images : (N, C, F, 15, 2)
        px.
    camera_matrix : (N, C, F, 3, 4)
        A homogeneous point of the world, mm, to one of the image, px.
    azimuth_rad : (N, C)
        Of the camera in its middle frame.
    mirror_margin : (N, C, 14)
    """

    cameras: np.ndarray
    stretch: np.ndarray
    truth: np.ndarray
    positions: np.ndarray
    images: np.ndarray
    camera_matrix: np.ndarray
    azimuth_rad: np.ndarray
    mirror_margin: np.ndarray


@dataclass(frozen=True)
class MotionsOfBoth:
    """The same clips with the mirror of each limb as the limb alone chooses it, and tried in the whole skeleton.

    Attributes
    ----------
    as_chosen, mirrors_tried : Motions
    clips, joints, limbs : DataFrame
        A row to each clip and camera; to each joint but the root of these; to each limb, with its objectives and bound,
        mm², of the programme's signs, of the trajectory that was made of them, and of the best that is known on the
        same programme.  ``mirrors_tried`` says which of both; certificates beside are made of the first alone.
    papers : DataFrame
        A row to each clip and camera, measured in the paper's conditions.
    """

    as_chosen: Motions
    mirrors_tried: Motions
    clips: pd.DataFrame
    joints: pd.DataFrame
    limbs: pd.DataFrame
    papers: pd.DataFrame
