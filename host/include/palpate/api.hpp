#pragma once

// What the shared libraries export. Everything else in them is hidden, and may change at any time.

/// A function or a class with all its members that programs may use.
#define PALPATE_API __attribute__((visibility("default")))
/// A member of an exported class that the library keeps to itself.
#define PALPATE_LOCAL __attribute__((visibility("hidden")))
