// AddressSanitizer's run-time library reads these options, in every build that has the library.

/// umockdev's library is loaded before the sanitizer's, and GLib keeps memory until exit. The
/// library finds the function only where it is visible.
extern "C" __attribute__((visibility("default"))) const char*
__asan_default_options() {  // NOLINT(bugprone-reserved-identifier)
  return "verify_asan_link_order=0:detect_leaks=0";
}
