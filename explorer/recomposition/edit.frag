#version 300 es
// SPDX-License-Identifier: BSD-3-Clause
// Recomposes a picture from the segments of its rays (method §2 "opacity change"):
// A' = 1 - exp(-strength * amount), C += T A' c', T *= 1 - A', front to back. Segments that are mixed
// make one homogeneous stretch: depths add, colours average weighted by them.
// Variants by #define: SHADED multiplies a channel's colour by the light on its own depth layer
// [Tikhonova 2010, Fig. 1d], ENHANCED darkens by depth-aware enhancement (eq. 11), TRUST
// gives the largest change that an unknown order could make, ATTENUATION gives a'_k of 4 channels,
// ONE_LAYER recomposes the segments that belong to one depth layer only.
precision highp float;
precision highp int;
precision highp usampler2D;
precision highp sampler2DArray;
precision highp sampler2D;

uniform usampler2D firstEntry;  // [pixel] index of the first entry, 0xffffffff = none
uniform usampler2D entries;     // explorer/recomposition/segments.h SegmentLists
uniform int listWidthLog2;
// A channel's linear rgb; w = -strength * unit * log2(e). WIDE: of more channels than uniforms hold.
#ifdef WIDE
uniform sampler2D table;        // row 0: that; row 1: r = depth layer of a channel, -1 = none
vec4 channelAt(int channel) { return texelFetch(table, ivec2(channel, 0), 0); }
int layerAt(int channel) { return int(texelFetch(table, ivec2(channel, 1), 0).r); }
#else
uniform vec4 channels[67];
uniform int layerOf[67];        // depth layer of a channel, -1 = none
vec4 channelAt(int channel) { return channels[channel]; }
int layerAt(int channel) { return layerOf[channel]; }
#endif
#ifdef SHADED
uniform sampler2DArray light;   // [layer] rgb = diffuse light, a = specular
#endif
#ifdef ENHANCED
uniform sampler2D enhancement;  // r of eq. 11 in [0, 1]
#endif
#ifdef ATTENUATION
uniform int group;
#endif
#ifdef ONE_LAYER
uniform int oneLayer;
#endif

out vec4 result;

const float kOpaque = 1.0 / 4096.0;

// explorer/recomposition/segments.h amountBits; unpackHalf2x16 would take as long as all the rest.
float amountOf(uint entry) {
  return uintBitsToFloat(((entry & 0xffffu) << 12) + 0x33000000u);
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  uint index = texelFetch(firstEntry, pixel, 0).r;
  vec3 color = vec3(0.0);
  float transmittance = 1.0;
#ifdef TRUST
  float doubt = 0.0;
  bool unordered = false;
#endif
#ifdef ATTENUATION
  vec4 attenuation = vec4(0.0);
#endif
  if (index != 0xffffffffu) {
    uint mask = (1u << uint(listWidthLog2)) - 1u;
    float depth = 0.0;         // of the stretch so far, in -log2
    vec3 glow = vec3(0.0);     // its colours, weighted by depth
#ifdef ATTENUATION
    vec4 own = vec4(0.0);      // its depth by channel of the group
#endif
#ifdef TRUST
    bool loose = false;
#endif
    for (;;) {
      uint entry = texelFetch(entries, ivec2(index & mask, index >> uint(listWidthLog2)), 0).r;
      int channel = int((entry >> 16) & 8191u);
      vec4 look = channelAt(channel);
      float part = amountOf(entry) * look.w;  // <= 0
#ifdef ONE_LAYER
      if (layerAt(channel) != oneLayer) part = 0.0;
#endif
#ifdef SHADED
      int layer = layerAt(channel);
      if (layer >= 0 && part < 0.0) {
        vec4 shine = texelFetch(light, ivec3(pixel, layer), 0);
        look.rgb = look.rgb * shine.rgb + shine.a;
      }
#endif
      depth += part;
      glow += part * look.rgb;
#ifdef ATTENUATION
      if (channel / 4 == group) own[channel & 3] += part;
#endif
#ifdef TRUST
      loose = loose || (entry & 0x40000000u) != 0u;
#endif
      bool last = (entry & 0x80000000u) != 0u;
      if ((entry & 0x20000000u) == 0u || last) {
        if (depth < 0.0) {
          float left = exp2(depth);
          float share = transmittance - transmittance * left;  // T A'
          glow /= depth;
#ifdef TRUST
          // What if this stretch stood in front of all before it? Its share would be A', not T A'.
          if (loose || unordered) {
            vec3 change = (1.0 - left) * (color - (1.0 - transmittance) * glow);
            doubt = max(doubt, max(abs(change.r), max(abs(change.g), abs(change.b))));
          }
          unordered = unordered || loose;
#endif
#ifdef ATTENUATION
          attenuation += share * own / depth;
#endif
          color += share * glow;
          transmittance *= left;
        }
        if (last || transmittance < kOpaque) break;
        depth = 0.0;
        glow = vec3(0.0);
#ifdef ATTENUATION
        own = vec4(0.0);
#endif
#ifdef TRUST
        loose = false;
#endif
      }
      ++index;
    }
  }
#ifdef ENHANCED
  color *= 1.0 - texelFetch(enhancement, pixel, 0).r;
#endif
#if defined(TRUST)
  result = vec4(doubt, 0.0, 0.0, 1.0);
#elif defined(ATTENUATION)
  result = attenuation;
#else
  result = vec4(color, 1.0 - transmittance);
#endif
}
