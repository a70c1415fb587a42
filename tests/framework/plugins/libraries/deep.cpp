// SPDX-License-Identifier: Apache-2.0
// A library that only another library needs; its versions have the same size.
int deep_number() { return VERSION; }
