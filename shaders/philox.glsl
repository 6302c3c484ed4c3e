// Philox-4x32-10 (Salmon, Moraes, Dror and Shaw 2011): four random words as a function of a counter
// and a key. There is no state, so that the order of execution does not matter.
// host/estimation/particles/particle_draws.hpp computes the same words.

uvec4 philox(uvec4 counter, uvec2 key) {
  for (uint round = 0; round < 10; ++round) {
    uvec2 high;
    uvec2 low;
    umulExtended(uvec2(0xD2511F53u, 0xCD9E8D57u), counter.xz, high, low);
    counter = uvec4(high.y ^ counter.y ^ key.x, low.y, high.x ^ counter.w ^ key.y, low.x);
    key += uvec2(0x9E3779B9u, 0xBB67AE85u);
  }
  return counter;
}
