// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

namespace marrow {

/// Looks over a YAML text before its values are made. Throws YAML::Exception, at its place, for what is valid YAML but
/// would bring a program down or be lost: nesting deeper than 100, aliases that multiply values beyond measure or hold
/// themselves, a second document.
void survey_yaml(const std::string& text);

}  // namespace marrow
