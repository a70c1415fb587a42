# SPDX-License-Identifier: Apache-2.0
"""Options that change no output, each with the reason."""
NO_EFFECT = {}
