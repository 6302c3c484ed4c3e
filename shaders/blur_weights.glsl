// Weights of a Gaussian by distance in bins, as constants of the kernel: a compiler then keeps them in
// the instructions, and the sums in registers.
layout(constant_id = 4) const float W0 = 0.0;
layout(constant_id = 5) const float W1 = 0.0;
layout(constant_id = 6) const float W2 = 0.0;
layout(constant_id = 7) const float W3 = 0.0;
layout(constant_id = 8) const float W4 = 0.0;
layout(constant_id = 9) const float W5 = 0.0;
layout(constant_id = 10) const float W6 = 0.0;
layout(constant_id = 11) const float W7 = 0.0;
layout(constant_id = 12) const float W8 = 0.0;
layout(constant_id = 13) const float W9 = 0.0;
layout(constant_id = 14) const float W10 = 0.0;
layout(constant_id = 15) const float W11 = 0.0;
layout(constant_id = 16) const float W12 = 0.0;
layout(constant_id = 17) const float W13 = 0.0;
layout(constant_id = 18) const float W14 = 0.0;
layout(constant_id = 19) const float W15 = 0.0;
layout(constant_id = 20) const float W16 = 0.0;
layout(constant_id = 21) const float W17 = 0.0;
layout(constant_id = 22) const float W18 = 0.0;
layout(constant_id = 23) const float W19 = 0.0;
layout(constant_id = 24) const float W20 = 0.0;
layout(constant_id = 25) const float W21 = 0.0;
layout(constant_id = 26) const float W22 = 0.0;
layout(constant_id = 27) const float W23 = 0.0;
layout(constant_id = 28) const float W24 = 0.0;
layout(constant_id = 29) const float W25 = 0.0;
layout(constant_id = 30) const float W26 = 0.0;
layout(constant_id = 31) const float W27 = 0.0;
layout(constant_id = 32) const float W28 = 0.0;
layout(constant_id = 33) const float W29 = 0.0;
layout(constant_id = 34) const float W30 = 0.0;
layout(constant_id = 35) const float W31 = 0.0;
layout(constant_id = 36) const float W32 = 0.0;

float weight_at[BLUR_CONSTANT_STEPS + 1];

void fill_weights() {
  weight_at[0] = W0; weight_at[1] = W1; weight_at[2] = W2; weight_at[3] = W3;
  weight_at[4] = W4; weight_at[5] = W5; weight_at[6] = W6; weight_at[7] = W7;
  weight_at[8] = W8; weight_at[9] = W9; weight_at[10] = W10; weight_at[11] = W11;
  weight_at[12] = W12; weight_at[13] = W13; weight_at[14] = W14; weight_at[15] = W15;
  weight_at[16] = W16; weight_at[17] = W17; weight_at[18] = W18; weight_at[19] = W19;
  weight_at[20] = W20; weight_at[21] = W21; weight_at[22] = W22; weight_at[23] = W23;
  weight_at[24] = W24; weight_at[25] = W25; weight_at[26] = W26; weight_at[27] = W27;
  weight_at[28] = W28; weight_at[29] = W29; weight_at[30] = W30; weight_at[31] = W31;
  weight_at[32] = W32;
}
