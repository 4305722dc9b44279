"""Inks as colours."""

from __future__ import annotations

import numpy as np

INK = "its inks (CMYK) become RGB"


def cmyk_to_rgb(pixels: np.ndarray, icc: bytes | None) -> tuple[np.ndarray, bytes | None]:
    """RGB of CMYK (h, w, 4; 0 = no ink) through its profile, or by the plain formula; the profile the RGB is in."""
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
            return rgb, srgb
        except (imagecodecs.CmsError, ValueError):
            pass  # a broken profile: colours by the formula are better than no picture
    white = np.iinfo(pixels.dtype).max
    light = white - pixels.astype(np.uint32)
    return ((light[..., :3] * light[..., 3:] + white // 2) // white).astype(pixels.dtype), None
