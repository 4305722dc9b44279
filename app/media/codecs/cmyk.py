"""CMYK: inks made into RGB."""

from __future__ import annotations

import numpy as np

from app.media.codecs.metadata import profile_name
from app.media.losses import few

INK = "its inks (CMYK) become RGB"


def cmyk_to_rgb(pixels: np.ndarray, icc: bytes | None) -> tuple[np.ndarray, bytes | None, str]:
    """RGB of CMYK (h, w, 4; 0 = no ink) through its profile, or by the plain formula; the profile the RGB is in.

    And what is told of it: by which profile, by its name, since the result has another.
    """
    told = INK
    if icc is not None:
        import imagecodecs

        srgb = imagecodecs.cms_profile("srgb")
        try:
            rgb = imagecodecs.cms_transform(
                np.ascontiguousarray(pixels),
                icc,
                srgb,
                colorspace="cmyk",
                outcolorspace="rgb",
                intent=imagecodecs.CMS.INTENT.RELATIVE_COLORIMETRIC,
            )
            return rgb, srgb, f"{INK} by its colour profile ({few([profile_name(icc) or 'unnamed'])})"
        except (imagecodecs.CmsError, ValueError):
            # colours by the formula are better than no picture
            name = few([profile_name(icc) or "unnamed"])
            told = f"{INK} without its colour profile ({name}), which is damaged or not for them"
    white = np.iinfo(pixels.dtype).max
    light = white - pixels.astype(np.uint32)
    return ((light[..., :3] * light[..., 3:] + white // 2) // white).astype(pixels.dtype), None, told
