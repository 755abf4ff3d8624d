// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <GL/glcorearb.h>

#include <functional>

/// The entry points of OpenGL 4.3 core that Vestige uses: X(Name, NAME) with glName of type
/// PFNGLNAMEPROC.
#define VESTIGE_GL_FUNCTIONS(X)                                     \
  /* state */                                                       \
  X(GetError, GETERROR)                                             \
  X(GetString, GETSTRING)                                           \
  X(GetIntegerv, GETINTEGERV)                                       \
  X(GetFloatv, GETFLOATV)                                           \
  X(GetIntegeri_v, GETINTEGERI_V)                                   \
  X(Enable, ENABLE)                                                 \
  X(Disable, DISABLE)                                               \
  X(Viewport, VIEWPORT)                                             \
  X(Scissor, SCISSOR)                                               \
  X(DepthFunc, DEPTHFUNC)                                           \
  X(DepthMask, DEPTHMASK)                                           \
  X(DepthRangef, DEPTHRANGEF)                                       \
  X(CullFace, CULLFACE)                                             \
  X(FrontFace, FRONTFACE)                                           \
  X(LineWidth, LINEWIDTH)                                           \
  X(PolygonOffset, POLYGONOFFSET)                                   \
  X(ColorMask, COLORMASK)                                           \
  X(ColorMaski, COLORMASKI)                                         \
  X(BlendFunc, BLENDFUNC)                                           \
  X(BlendFuncSeparate, BLENDFUNCSEPARATE)                           \
  X(BlendFunci, BLENDFUNCI)                                         \
  X(BlendEquation, BLENDEQUATION)                                   \
  X(BlendEquationSeparate, BLENDEQUATIONSEPARATE)                   \
  X(BlendEquationi, BLENDEQUATIONI)                                 \
  X(BlendColor, BLENDCOLOR)                                         \
  X(Enablei, ENABLEI)                                               \
  X(Disablei, DISABLEI)                                             \
  X(StencilFunc, STENCILFUNC)                                       \
  X(StencilOp, STENCILOP)                                           \
  X(StencilMask, STENCILMASK)                                       \
  X(PixelStorei, PIXELSTOREI)                                       \
  X(Flush, FLUSH)                                                   \
  X(Finish, FINISH)                                                 \
  /* clearing and reading */                                        \
  X(Clear, CLEAR)                                                   \
  X(ClearColor, CLEARCOLOR)                                         \
  X(ClearDepthf, CLEARDEPTHF)                                       \
  X(ClearStencil, CLEARSTENCIL)                                     \
  X(ClearBufferfv, CLEARBUFFERFV)                                   \
  X(ClearBufferiv, CLEARBUFFERIV)                                   \
  X(ClearBufferuiv, CLEARBUFFERUIV)                                 \
  X(ReadBuffer, READBUFFER)                                         \
  X(ReadPixels, READPIXELS)                                         \
  X(DrawBuffers, DRAWBUFFERS)                                       \
  /* textures and samplers */                                       \
  X(GenTextures, GENTEXTURES)                                       \
  X(DeleteTextures, DELETETEXTURES)                                 \
  X(BindTexture, BINDTEXTURE)                                       \
  X(ActiveTexture, ACTIVETEXTURE)                                   \
  X(TexParameteri, TEXPARAMETERI)                                   \
  X(TexParameterf, TEXPARAMETERF)                                   \
  X(TexParameterfv, TEXPARAMETERFV)                                 \
  X(TexImage2D, TEXIMAGE2D)                                         \
  X(TexImage3D, TEXIMAGE3D)                                         \
  X(TexSubImage2D, TEXSUBIMAGE2D)                                   \
  X(TexSubImage3D, TEXSUBIMAGE3D)                                   \
  X(TexStorage1D, TEXSTORAGE1D)                                     \
  X(TexStorage2D, TEXSTORAGE2D)                                     \
  X(TexStorage3D, TEXSTORAGE3D)                                     \
  X(TexBuffer, TEXBUFFER)                                           \
  X(GetTexImage, GETTEXIMAGE)                                       \
  X(GetTexLevelParameteriv, GETTEXLEVELPARAMETERIV)                 \
  X(GenerateMipmap, GENERATEMIPMAP)                                 \
  X(CopyTexSubImage2D, COPYTEXSUBIMAGE2D)                           \
  X(BindImageTexture, BINDIMAGETEXTURE)                             \
  X(GenSamplers, GENSAMPLERS)                                       \
  X(DeleteSamplers, DELETESAMPLERS)                                 \
  X(BindSampler, BINDSAMPLER)                                       \
  X(SamplerParameteri, SAMPLERPARAMETERI)                           \
  /* framebuffers */                                                \
  X(GenFramebuffers, GENFRAMEBUFFERS)                               \
  X(DeleteFramebuffers, DELETEFRAMEBUFFERS)                         \
  X(BindFramebuffer, BINDFRAMEBUFFER)                               \
  X(CheckFramebufferStatus, CHECKFRAMEBUFFERSTATUS)                 \
  X(FramebufferTexture, FRAMEBUFFERTEXTURE)                         \
  X(FramebufferTexture2D, FRAMEBUFFERTEXTURE2D)                     \
  X(FramebufferTextureLayer, FRAMEBUFFERTEXTURELAYER)               \
  X(FramebufferRenderbuffer, FRAMEBUFFERRENDERBUFFER)               \
  X(BlitFramebuffer, BLITFRAMEBUFFER)                               \
  X(GenRenderbuffers, GENRENDERBUFFERS)                             \
  X(DeleteRenderbuffers, DELETERENDERBUFFERS)                       \
  X(BindRenderbuffer, BINDRENDERBUFFER)                             \
  X(RenderbufferStorage, RENDERBUFFERSTORAGE)                       \
  X(RenderbufferStorageMultisample, RENDERBUFFERSTORAGEMULTISAMPLE) \
  /* buffers */                                                     \
  X(GenBuffers, GENBUFFERS)                                         \
  X(DeleteBuffers, DELETEBUFFERS)                                   \
  X(BindBuffer, BINDBUFFER)                                         \
  X(BindBufferBase, BINDBUFFERBASE)                                 \
  X(BindBufferRange, BINDBUFFERRANGE)                               \
  X(BufferData, BUFFERDATA)                                         \
  X(BufferSubData, BUFFERSUBDATA)                                   \
  X(GetBufferSubData, GETBUFFERSUBDATA)                             \
  X(CopyBufferSubData, COPYBUFFERSUBDATA)                           \
  X(ClearBufferData, CLEARBUFFERDATA)                               \
  X(MapBufferRange, MAPBUFFERRANGE)                                 \
  X(UnmapBuffer, UNMAPBUFFER)                                       \
  /* vertices and drawing */                                        \
  X(GenVertexArrays, GENVERTEXARRAYS)                               \
  X(DeleteVertexArrays, DELETEVERTEXARRAYS)                         \
  X(BindVertexArray, BINDVERTEXARRAY)                               \
  X(EnableVertexAttribArray, ENABLEVERTEXATTRIBARRAY)               \
  X(DisableVertexAttribArray, DISABLEVERTEXATTRIBARRAY)             \
  X(VertexAttribPointer, VERTEXATTRIBPOINTER)                       \
  X(VertexAttribIPointer, VERTEXATTRIBIPOINTER)                     \
  X(VertexAttribDivisor, VERTEXATTRIBDIVISOR)                       \
  X(VertexAttrib4f, VERTEXATTRIB4F)                                 \
  X(DrawArrays, DRAWARRAYS)                                         \
  X(DrawElements, DRAWELEMENTS)                                     \
  X(DrawArraysInstanced, DRAWARRAYSINSTANCED)                       \
  X(DrawElementsInstanced, DRAWELEMENTSINSTANCED)                   \
  /* programs */                                                    \
  X(CreateShader, CREATESHADER)                                     \
  X(DeleteShader, DELETESHADER)                                     \
  X(ShaderSource, SHADERSOURCE)                                     \
  X(CompileShader, COMPILESHADER)                                   \
  X(GetShaderiv, GETSHADERIV)                                       \
  X(GetShaderInfoLog, GETSHADERINFOLOG)                             \
  X(CreateProgram, CREATEPROGRAM)                                   \
  X(DeleteProgram, DELETEPROGRAM)                                   \
  X(AttachShader, ATTACHSHADER)                                     \
  X(DetachShader, DETACHSHADER)                                     \
  X(LinkProgram, LINKPROGRAM)                                       \
  X(UseProgram, USEPROGRAM)                                         \
  X(GetProgramiv, GETPROGRAMIV)                                     \
  X(GetProgramInfoLog, GETPROGRAMINFOLOG)                           \
  X(BindAttribLocation, BINDATTRIBLOCATION)                         \
  X(BindFragDataLocation, BINDFRAGDATALOCATION)                     \
  X(GetAttribLocation, GETATTRIBLOCATION)                           \
  X(GetUniformLocation, GETUNIFORMLOCATION)                         \
  X(GetUniformBlockIndex, GETUNIFORMBLOCKINDEX)                     \
  X(UniformBlockBinding, UNIFORMBLOCKBINDING)                       \
  X(Uniform1i, UNIFORM1I)                                           \
  X(Uniform2i, UNIFORM2I)                                           \
  X(Uniform3i, UNIFORM3I)                                           \
  X(Uniform4i, UNIFORM4I)                                           \
  X(Uniform1ui, UNIFORM1UI)                                         \
  X(Uniform1f, UNIFORM1F)                                           \
  X(Uniform2f, UNIFORM2F)                                           \
  X(Uniform3f, UNIFORM3F)                                           \
  X(Uniform4f, UNIFORM4F)                                           \
  X(Uniform1iv, UNIFORM1IV)                                         \
  X(Uniform1fv, UNIFORM1FV)                                         \
  X(Uniform2fv, UNIFORM2FV)                                         \
  X(Uniform3fv, UNIFORM3FV)                                         \
  X(Uniform4fv, UNIFORM4FV)                                         \
  X(UniformMatrix3fv, UNIFORMMATRIX3FV)                             \
  X(UniformMatrix4fv, UNIFORMMATRIX4FV)                             \
  /* compute, queries, synchronisation */                           \
  X(DispatchCompute, DISPATCHCOMPUTE)                               \
  X(MemoryBarrier, MEMORYBARRIER)                                   \
  X(GenQueries, GENQUERIES)                                         \
  X(DeleteQueries, DELETEQUERIES)                                   \
  X(BeginQuery, BEGINQUERY)                                         \
  X(EndQuery, ENDQUERY)                                             \
  X(GetQueryObjectuiv, GETQUERYOBJECTUIV)                           \
  X(GetQueryObjectui64v, GETQUERYOBJECTUI64V)                       \
  X(FenceSync, FENCESYNC)                                           \
  X(ClientWaitSync, CLIENTWAITSYNC)                                 \
  X(DeleteSync, DELETESYNC)

namespace vestige::gl {

/// The entry points of one device's context, named without "gl".
struct Functions {
#define VESTIGE_GL_MEMBER(name, NAME) PFNGL##NAME##PROC name = nullptr;
  VESTIGE_GL_FUNCTIONS(VESTIGE_GL_MEMBER)
#undef VESTIGE_GL_MEMBER

  using Loader = std::function<void*(const char* name)>;
  /// Throws NoGl naming the first function that the library does not have.
  static Functions load(const Loader& loader);
};

/// The functions of the device whose thread this is; throws Internal outside Device::run.
const Functions& functions();

}  // namespace vestige::gl
