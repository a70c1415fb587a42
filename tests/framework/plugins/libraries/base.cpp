// SPDX-License-Identifier: Apache-2.0
// A library that a plugin links, and that needs one in turn.
int deep_number();
int base_number() { return 10 * deep_number() + VERSION; }
