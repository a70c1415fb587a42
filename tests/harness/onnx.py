# SPDX-License-Identifier: Apache-2.0
"""Writes small networks as ONNX files without a library for them: convolutions with given weights, one after the
other or beside each other. Field numbers are those of onnx.proto."""
import struct


def _varint(number):
    found = b""
    number &= (1 << 64) - 1
    while number > 127:
        found += bytes([number & 127 | 128])
        number >>= 7
    return found + bytes([number])


def _field(number, value):
    """A whole number as a varint; bytes and texts with their length."""
    if isinstance(value, int):
        return _varint(number << 3) + _varint(value)
    value = value.encode() if isinstance(value, str) else value
    return _varint(number << 3 | 2) + _varint(len(value)) + value


def _shape(name, sides):
    dimensions = b"".join(_field(1, _field(1, side)) for side in sides)
    return _field(1, name) + _field(2, _field(1, _field(1, 1) + _field(2, dimensions)))


def tensor(name, sides, values):
    """Weights of a layer, as 32-bit floats."""
    parts = b"".join(_field(1, side) for side in sides) + _field(2, 1) + _field(8, name)
    return parts + _field(9, struct.pack("<%df" % len(values), *values))


def _numbers(name, numbers):
    return _field(5, _field(1, name) + b"".join(_field(8, number) for number in numbers) + _field(20, 7))


def node(kind, inputs, output, **attributes):
    """One layer. Attributes are lists of whole numbers."""
    parts = b"".join(_field(1, name) for name in inputs) + _field(2, output) + _field(3, output + "_layer")
    return parts + _field(4, kind) + b"".join(_numbers(*attribute) for attribute in attributes.items())


def convolution(source, output, weights, bias):
    """A convolution of source ("image" or another output) that keeps the size of its input. weights: by output
    channel, input channel, row, column, as nested lists with odd sides. Returns its layer and its tensors."""
    outs, ins, rows, columns = len(weights), len(weights[0]), len(weights[0][0]), len(weights[0][0][0])
    flat = [value for one in weights for channel in one for row in channel for value in row]
    pads = [rows // 2, columns // 2] * 2
    layer = node("Conv", [source, output + "_w", output + "_b"], output, kernel_shape=[rows, columns], pads=pads)
    return layer, [tensor(output + "_w", [outs, ins, rows, columns], flat), tensor(output + "_b", [outs], bias)]


def model(layers, tensors, outputs, rows, columns, channels=1):
    """The bytes of a network with the input "image". layers: what node() and convolution() gave; outputs: name ->
    (channels, rows, columns)."""
    graph = b"".join(_field(1, layer) for layer in layers) + _field(2, "network")
    graph += b"".join(_field(5, tensor) for tensor in tensors)
    graph += _field(11, _shape("image", [1, channels, rows, columns]))
    graph += b"".join(_field(12, _shape(name, [1, *sides])) for name, sides in outputs.items())
    return _field(1, 6) + _field(2, "marrow") + _field(7, graph) + _field(8, _field(1, "") + _field(2, 11))
