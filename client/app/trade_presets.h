#pragma once

#include <filesystem>
#include <iosfwd>

#include "client/app/trade_command.h"

namespace umbriel {

// The thesis' experiments (Hempe 2005, chapter 10; Ganster 2002, 1.3) and our own checks: each prints a table for every
// run and says of each expected ordering whether it is met, with the figures. What needs a technique that this version
// does not draw is said to be open. Exit code 0 when the preset ran, whatever it found.
int runTradePreset(const TradeArguments& arguments, const std::filesystem::path& serverProgram, std::ostream& out);

}  // namespace umbriel
