// SPDX-License-Identifier: Apache-2.0
// Must not compile: a member that `fields` leaves out would be neither hashed nor stored.
#include <marrow/plugin.hpp>

struct Forgetful {
  int counted = 0;
  int forgotten = 0;
  using fields = marrow::Fields<&Forgetful::counted>;
};

marrow::Digest digest_of(const Forgetful& value) { return marrow::hash_of(value); }
