"""Whole skeletons reconstructed from several cameras, and their errors: park2011 figure 4."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd


@dataclass(frozen=True)
class Motions:
    """Reconstructions of N clips, each from C cameras.

    Attributes
    ----------
    cameras : (C,) text
    stretch : (N,) int
        Numbers of the stretches in the data set.
    truth : (N, F, 15, 3)
        mm.
    positions : (N, C, F, 15, 3)
        mm.
    images : (N, C, F, 15, 2)
        px.
    camera_matrix : (N, C, F, 3, 4)
        Maps a homogeneous point of the world, mm, to one of the image, px.
    azimuth_rad : (N, C)
        Azimuth of the camera in its middle frame.
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
    """Reconstructions of clips by two methods, without and with trials of mirrored limbs.

    Attributes
    ----------
    as_chosen, mirrors_tried : Motions
    clips, joints, limbs : DataFrame
        Rows by clip and camera; by joint except the root; by limb, with objectives and bound, mm²: of the programme's
        signs, of the resulting trajectory, and of the best known solution of the same programme.  ``mirrors_tried``
        distinguishes the variants; only the first has separate certificates.
    papers : DataFrame
        A row for each clip and camera, in the paper's conditions.
    """

    as_chosen: Motions
    mirrors_tried: Motions
    clips: pd.DataFrame
    joints: pd.DataFrame
    limbs: pd.DataFrame
    papers: pd.DataFrame
