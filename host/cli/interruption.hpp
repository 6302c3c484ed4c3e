#pragma once

namespace palpate::cli {

/// From now on SIGINT (Ctrl-C), SIGHUP and SIGTERM do not end the program; interrupted() tells
/// whether one of them came. A signal that is ignored stays so.
void catch_interruptions();
bool interrupted();

}  // namespace palpate::cli
