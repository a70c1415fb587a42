# SPDX-License-Identifier: Apache-2.0
"""Images as a network sees them, as plugins/toolbox/network computes them, and how training changes them at random."""
import cv2
import numpy as np

DARKEST = 0.005  # of the grey value in air, as in plugins/toolbox/image/grey_values.hpp
RIM_PX = 16  # the coarsest pixel of a network
SCALE = (0, 2)  # these line integrals become 0 and 1: percentiles would follow a collimator's blades


def line_integrals(grey):
    """-log(grey / air); air is the greatest grey value, and grey values are counted from 0."""
    grey = grey.astype(np.float32)
    return -np.log(np.clip(grey / max(float(grey.max()), 1e-6), DARKEST, 1))


def normalised(values, low, high):
    """(value - p_low) / (p_high - p_low), with the percentiles of all pixels. A constant image becomes 0."""
    least, most = np.percentile(values, (low, high))
    if not most > least:
        return np.zeros_like(values, np.float32)
    return ((values - least) / (most - least)).astype(np.float32)


def scaled(line_integrals):
    """Line integrals as a network takes them."""
    low, high = SCALE
    return ((line_integrals - low) / (high - low)).astype(np.float32)


def input_of_card(pixel_mm, tile_px, overlap_px):
    """What the card of a network says of such images."""
    low, high = SCALE
    return {
        "values": "line_integrals",
        "bone": "bright",
        "pixel_mm": pixel_mm,
        "normalise": {"method": "fixed", "low": low, "high": high},
        "size_px": list(tile_px),
        "overlap_px": overlap_px,
    }


def widened(values):
    """A whole image as a network takes it: continued by its mirror image, by RIM_PX above and to the left, and to
    multiples of it."""
    rows, columns = values.shape
    return cv2.copyMakeBorder(
        values, RIM_PX, RIM_PX + -rows % RIM_PX, RIM_PX, RIM_PX + -columns % RIM_PX, cv2.BORDER_REFLECT_101
    )


def resized(values, step_px):
    """The image in the network's pixels, each as large as step_px pixels of the image."""
    rows, columns = (max(1, round(side / step_px)) for side in values.shape)
    smaller = rows < values.shape[0] or columns < values.shape[1]
    return cv2.resize(values, (columns, rows), interpolation=cv2.INTER_AREA if smaller else cv2.INTER_LINEAR)


def smooth_field(random, shape, nodes):
    """A smooth random field, about normal with deviation 1, with so many nodes along the longer side."""
    coarse = random.normal(0, 1, (nodes, nodes)).astype(np.float32)
    return cv2.resize(coarse, (shape[1], shape[0]), interpolation=cv2.INTER_CUBIC)


def changed(random, values):
    """Line integrals as another device might show them: another contrast, gamma and brightness, uneven brightness,
    blur, noise of several widths, saturation. Each change comes by chance, and weak ones are more usual than strong
    ones."""
    values = values.astype(np.float32)
    if random.random() < 0.7:
        values = values * np.float32(np.exp(random.normal(0, 0.3))) + np.float32(random.normal(0, 0.15))
    scale = max(float(np.percentile(values, 99) - np.percentile(values, 1)), 1e-3)
    if random.random() < 0.7:
        low = float(values.min())
        values = low + scale * ((values - low) / scale) ** np.float32(np.exp(random.normal(0, 0.25)))
    if random.random() < 0.5:
        values = values + scale * abs(random.normal(0, 0.12)) * smooth_field(
            random, values.shape, random.integers(2, 6)
        )
    if random.random() < 0.3:
        values = cv2.GaussianBlur(values, (0, 0), random.uniform(0.4, 1.2))
    if random.random() < 0.6:
        noise = random.normal(0, 1, values.shape).astype(np.float32)
        width = random.uniform(0, 1.2)
        if width > 0.4:
            noise = cv2.GaussianBlur(noise, (0, 0), width)
            noise /= noise.std()
        values = values + scale * abs(random.normal(0, 0.04)) * noise
    if random.random() < 0.3:
        values = np.minimum(values, np.percentile(values, random.uniform(90, 99.5)))
    if random.random() < 0.2:
        values = np.maximum(values, np.percentile(values, random.uniform(1, 15)))
    return values.astype(np.float32)


def outside_of_round_field(random, shape):
    """True outside of the field of an image intensifier, somewhere about the middle of the image."""
    rows, columns = shape
    middle = 0.5 * np.array(shape) + random.normal(0, 0.06, 2) * shape
    radius = random.uniform(0.36, 0.7) * min(shape)
    v, u = np.ogrid[:rows, :columns]
    return (v - middle[0]) ** 2 + (u - middle[1]) ** 2 > radius**2


def covered(random, values, outside):
    """The image with what is outside of the field black, seldom white, and a rim that is a little blurred."""
    share = cv2.GaussianBlur(outside.astype(np.float32), (0, 0), random.uniform(0.5, 2.5))
    black = 0 if random.random() < 0.15 else random.uniform(2.5, -np.log(DARKEST))
    return (values * (1 - share) + np.float32(black) * share).astype(np.float32)


def random_motion(random, size_px, middle_px, zoom):
    """A 2 x 3 matrix that takes pixels of the image to those of a tile: by chance turned by any angle or a little,
    mirrored, larger or smaller by up to `zoom`, with the place middle_px of the image in the tile's middle."""
    angle = random.uniform(0, 2 * np.pi) if random.random() < 0.3 else random.normal(0, 0.2)
    factor = np.exp(random.uniform(-1, 1) * np.log(zoom))
    turn = factor * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    if random.random() < 0.5:
        turn[:, 0] *= -1
    middle_of_tile = 0.5 * (np.array(size_px[::-1]) - 1)
    return np.column_stack([turn, middle_of_tile - turn @ np.asarray(middle_px)])


def moved(plane, matrix, size_px, interpolation=cv2.INTER_LINEAR):
    """The tile of an image, continued by its mirror image."""
    return cv2.warpAffine(plane, matrix, size_px[::-1], flags=interpolation, borderMode=cv2.BORDER_REFLECT_101)
