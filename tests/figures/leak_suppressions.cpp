/// Read by LeakSanitizer: fontconfig, which Cairo finds its fonts with, never frees its cache.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libfontconfig"; }
