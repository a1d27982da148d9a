/* liquidblend in C: clients of a server, and players of frames for loops that must not wait.
 *
 * Rules that hold everywhere
 * - Functions that can fail return an lb_status. Its text is lb_last_error(), of the calling thread.
 * - The first member of every struct is struct_size, but for lb_option and lb_parameter, which stay
 *   as they are. Set it to sizeof the struct, and all else that you do not use to 0, which means
 *   the default (offsets of lb_layout: to -1). Programs that were compiled against an older header,
 *   whose structs are shorter, go on working.
 * - Handles are opaque. What a function gives by `out` belongs to the caller, who frees it by the
 *   function of that name; freeing NULL does nothing. On an error `out` is NULL.
 * - Texts are UTF-8. Texts and arrays in the structs that describe a handle belong to the handle.
 * - Positions are metres, times seconds, velocities metres per second, in the world that the
 *   animations were imported from. Triangles are counter-clockwise seen from outside.
 * - No function throws, and none ends the program.
 * - Threads: functions of different handles may run at the same time; of one handle, as each says.
 */
#ifndef LIQUIDBLEND_LIQUIDBLEND_H_
#define LIQUIDBLEND_LIQUIDBLEND_H_

#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32)
#define LB_API __declspec(dllimport)
#else
#define LB_API __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- errors */

/* The codes of gRPC and Abseil. */
typedef enum lb_status {
  LB_OK = 0,
  LB_CANCELLED = 1,
  LB_UNKNOWN = 2,
  LB_INVALID_ARGUMENT = 3,
  LB_DEADLINE_EXCEEDED = 4,
  LB_NOT_FOUND = 5,
  LB_ALREADY_EXISTS = 6,
  LB_PERMISSION_DENIED = 7,
  LB_RESOURCE_EXHAUSTED = 8,
  LB_FAILED_PRECONDITION = 9,
  LB_ABORTED = 10,
  LB_OUT_OF_RANGE = 11,
  LB_UNIMPLEMENTED = 12,
  LB_INTERNAL = 13,
  LB_UNAVAILABLE = 14,
  LB_DATA_LOSS = 15,
  LB_UNAUTHENTICATED = 16
} lb_status;

/* "NOT_FOUND" and so on; "UNKNOWN" for a number that is none of them. */
LB_API const char* lb_status_name(lb_status status);
/* What was wrong with the last call of this thread that failed; "" before the first one. Valid until
 * the thread's next call that fails. */
LB_API const char* lb_last_error(void);
/* Its reason for programs, as servers give it (docs/errors.md): "FAMILY_BUSY", or the code's name
 * where that says it all. "" if no server has said it. Valid as lb_last_error(). */
LB_API const char* lb_last_error_reason(void);

/* The version of the library: 1000000 * major + 1000 * minor + patch. */
LB_API int32_t lb_version(void);

/* ---- callbacks */

/* Memory of frames. Called from any thread, also at the same time. */
typedef struct lb_allocator {
  size_t struct_size;
  /* Memory of that many bytes, aligned as malloc's; NULL: there is none. */
  void* (*allocate)(void* user, size_t num_bytes);
  void (*release)(void* user, void* memory);
  void* user;
} lb_allocator;

/* One line for a log: what the library would otherwise keep to itself, such as a server that is gone
 * and back. Called within lb_player_poll(). */
typedef void (*lb_log_function)(void* user, const char* message);

/* ---- clients */

/* A connection to servers.  Threads: all functions of a client are safe. */
typedef struct lb_client lb_client;

typedef struct lb_connect_options {
  size_t struct_size;
  /* HOST:PORT, or several, separated by commas: servers of one store, asked in turn.
   * NULL: 127.0.0.1:50051 */
  const char* target;
  const char* token; /* NULL: none; sent with TLS, or on this machine, only */
  int32_t tls;       /* 1: with the system's authorities; also 1 if one of the next three is set */
  const char* tls_ca;   /* file of authorities trusted for the server */
  const char* tls_cert; /* file of a certificate to show, with its key */
  const char* tls_key;
  const char* tls_server_name; /* that the server's certificate is for; NULL: the target's host */
  double connect_timeout_s;    /* 0: 5 */
  double call_timeout_s;       /* of one attempt of a short call; 0: 30 */
  double patience_s;           /* how long calls are tried again while no server can be reached, or
                                * servers ask to wait; 0: 30; negative: not at all */
  const lb_allocator* allocator; /* of frames' memory; NULL: malloc. Kept as it is now */
  const char* traceparent;       /* of the W3C's Trace Context, sent with all calls; NULL: none */
} lb_connect_options;

/* Connects, and waits until a server answers.
 *   options  NULL: all defaults */
LB_API lb_status lb_client_connect(const lb_connect_options* options, lb_client** out);
LB_API void lb_client_free(lb_client* client);

/* ---- families */

/* One version of a family.  Threads: safe, it never changes. */
typedef struct lb_family lb_family;

/* Upward direction. LB_UP_UNKNOWN: z is assumed. */
typedef enum lb_up {
  LB_UP_UNKNOWN = 0,
  LB_UP_X = 1,
  LB_UP_Y = 2,
  LB_UP_Z = 3,
  LB_UP_MINUS_X = 4,
  LB_UP_MINUS_Y = 5,
  LB_UP_MINUS_Z = 6
} lb_up;

typedef struct lb_family_info {
  size_t struct_size;
  const char* name; /* families/{id} */
  int64_t version;  /* 0: none is registered yet, or not known (a file) */
  const char* source;
  size_t num_targets;
  const char* const* targets; /* animations/{id}; blend weights are in this order */
  double duration_s;          /* times are in [0, duration_s] */
  double frames_per_second;
  lb_up up;
  double bounds_min[3]; /* of all blends */
  double bounds_max[3];
  int32_t num_levels; /* of detail, with the finest */
  size_t num_parameters;
  const char* const* parameters; /* names of the parameter space; none: weights only */
  const double* points;          /* of the source and each target: num_parameters numbers each */
  const char* json;              /* all that the server says (liquidblend.v1.Family); "" of a
                                  * player, and so is `source` */
} lb_family_info;

/*   name     the id, with or without "families/"
 *   version  0: the published one */
LB_API lb_status lb_client_get_family(lb_client* client, const char* name, int64_t version,
                                      lb_family** out);
LB_API void lb_family_describe(const lb_family* family, lb_family_info* info);
LB_API void lb_family_free(lb_family* family);

/* Names of all families, animations or operations, in a JSON array of texts. */
typedef struct lb_text lb_text;
LB_API const char* lb_text_get(const lb_text* text);
LB_API void lb_text_free(lb_text* text);

/* Publishes a kept version again, as the newest one, which `out` describes. */
LB_API lb_status lb_client_rollback_family(lb_client* client, const char* name, int64_t version,
                                           lb_family** out);
LB_API lb_status lb_client_list_families(lb_client* client, lb_text** out);
LB_API lb_status lb_client_list_animations(lb_client* client, lb_text** out);
LB_API lb_status lb_client_list_operations(lb_client* client, lb_text** out);
/* An animation as JSON (liquidblend.v1.Animation). */
LB_API lb_status lb_client_get_animation(lb_client* client, const char* name, lb_text** out);
LB_API lb_status lb_client_delete_animation(lb_client* client, const char* name);
LB_API lb_status lb_client_delete_family(lb_client* client, const char* name);
/* Downloads the stored file of "families/f" or "animations/a". It is whole, or missing.
 *   version  of a family; 0: the published one */
LB_API lb_status lb_client_download(lb_client* client, const char* name, int64_t version,
                                    const char* path);

/* ---- work that takes long */

/* State of an import or a registration.  Threads: safe, it never changes. */
typedef struct lb_operation lb_operation;

typedef struct lb_operation_info {
  size_t struct_size;
  const char* name;    /* operations/{id} */
  const char* subject; /* the animation or family that it makes; "": not known */
  const char* stage;
  double fraction; /* of the whole, [0, 1] */
  double seconds_elapsed;
  double seconds_left; /* 0: not known */
  int32_t done;
  lb_status status; /* of what is done */
  const char* error;
  const char* reason;      /* of some failures: "VERDICT_TOO_LOW", say; "": none */
  const char* waiting_for; /* why it is queued, if not for its turn alone */
  int64_t version;         /* that a registration has published; 0: none */
  int32_t grade;           /* of that version: 0 not known, 1 good, 2 doubtful, 3 too different */
} lb_operation_info;

LB_API void lb_operation_describe(const lb_operation* operation, lb_operation_info* info);
LB_API void lb_operation_free(lb_operation* operation);

typedef struct lb_import_request {
  size_t struct_size;
  const char* animation; /* the id */
  const char* directory; /* with the frames, on this machine; they are uploaded */
  const char* pattern;   /* of frames' names, as "foam.*"; NULL: all */
  double frames_per_second; /* this and the next three: 0: as meta.json says */
  double vertex_scale;      /* metres per unit of the files' positions */
  double velocity_scale;    /* metres per second per unit of the files' velocities */
  double voxel_size_m;      /* of Mantaflow */
  lb_up up;
  int32_t allow_gaps; /* frame numbers may be missing */
  int32_t priority;   /* [-100, 100]; larger ones are worked on first */
  int32_t reserved;
} lb_import_request;

/* Uploads frames and starts their import. */
LB_API lb_status lb_client_import(lb_client* client, const lb_import_request* request,
                                  lb_operation** out);

/* A pair of places in space-time that must, or should, fall on each other. */
typedef struct lb_correspondence {
  size_t struct_size;
  int32_t target; /* index of the target */
  int32_t kind;   /* 0 a point, 1 a trajectory, 2 pinned in space */
  int32_t hard;   /* 1: must */
  double source_position[3];
  double source_time_s;
  double target_position[3];
  double target_time_s;
  double length_s; /* of kinds 1 and 2; 0: to the end */
} lb_correspondence;

/* An option as text: its name in liquidblend.v1.RegistrationOptions and its value, "seed" and "7". */
typedef struct lb_option {
  const char* name;
  const char* value; /* a number, or "true" or "false" */
} lb_option;

typedef struct lb_register_request {
  size_t struct_size;
  const char* family; /* the id */
  const char* source; /* an animation's id */
  size_t num_targets;
  const char* const* targets; /* animations' ids */
  size_t num_correspondences;
  const lb_correspondence* correspondences;
  size_t num_parameters;         /* 1 to 4; 0: no parameter space */
  const char* const* parameters; /* their names */
  const double* points;          /* of the source, then each target: num_parameters numbers each */
  int32_t refine;  /* go on from the newest version, with these correspondences */
  int32_t replace; /* publish a new version of a family that exists */
  int32_t required_grade;         /* publish only if no target is worse: 1 good, 2 doubtful; 0: any */
  int32_t priority;               /* [-100, 100] */
  size_t num_options;
  const lb_option* options; /* of the registration; others have the server's defaults */
} lb_register_request;

LB_API lb_status lb_client_register(lb_client* client, const lb_register_request* request,
                                    lb_operation** out);
LB_API lb_status lb_client_get_operation(lb_client* client, const char* name, lb_operation** out);
LB_API lb_status lb_client_cancel(lb_client* client, const char* operation);

/* Called for each change of a job that is watched. Returns 0 to stop watching. */
typedef int32_t (*lb_progress_function)(void* user, const lb_operation* operation);

/* Waits until the operation is done, through lost connections and restarts.
 *   progress  NULL: none; called on this thread
 *   out       the operation as it was last seen; how it ended is in its `status`
 * Errors: LB_CANCELLED if `progress` said so; the operation itself goes on. */
LB_API lb_status lb_client_watch(lb_client* client, const char* operation,
                                 lb_progress_function progress, void* user, lb_operation** out);
/* Likewise, for so many seconds, whatever the servers do; INFINITY: as long as it takes.
 * Errors: LB_DEADLINE_EXCEEDED afterwards. */
LB_API lb_status lb_client_watch_for(lb_client* client, const char* operation, double timeout_s,
                                     lb_progress_function progress, void* user, lb_operation** out);

/* ---- frames */

/* The surface at one time.  Threads: safe, it never changes. */
typedef struct lb_frame lb_frame;

/* One coordinate of a point in a family's parameter space. */
typedef struct lb_parameter {
  const char* name;
  double value;
} lb_parameter;

/* Attributes of vertices beside their positions. */
enum {
  LB_NORMALS = 1,       /* three floats, unit length, outward */
  LB_VELOCITIES = 2,    /* three floats */
  LB_REST_POSITIONS = 4 /* four floats: place in the source and its time, the same for a place of the
                         * liquid at any weights: texture coordinates that stick */
};

/* What is made of the surface. All 0: the slice itself. */
typedef struct lb_surface {
  size_t struct_size;
  uint32_t attributes;     /* LB_NORMALS and so on, added up */
  int32_t level_of_detail; /* 0: the finest */
  int32_t smoothing_passes;  /* [0, 32]; evens out triangles */
  double temporal_smoothing; /* [0, 1]; against flicker */
  int32_t position_bits;     /* [8, 20]; of the grid that positions are rounded to; 0: 14. Above 16
                              * frames need longer to be made and decoded; of players [8, 16] */
  int32_t reserved;
  double smoothing_strength; /* (0, 1]; how far a pass goes; 0: 0.5 */
  int32_t laplacian;         /* 1: smoothing passes are the paper's, which shrink small parts */
  int32_t reserved_2;
} lb_surface;

typedef struct lb_frame_request {
  size_t struct_size;
  const char* family;
  int64_t version; /* 0: the newest */
  size_t num_weights;
  const double* weights; /* one per target; [-1, 2]; the source gets 1 - their sum */
  size_t num_parameters;
  const lb_parameter* parameters; /* instead of weights */
  int32_t extrapolate;            /* parameters outside of the family's points are no error */
  double time_s;
  const lb_surface* surface; /* NULL: the slice itself */
} lb_frame_request;

LB_API lb_status lb_client_get_frame(lb_client* client, const lb_frame_request* request,
                                     lb_frame** out);

typedef struct lb_frame_info {
  size_t struct_size;
  uint32_t num_vertices;
  uint32_t num_triangles;
  const float* positions;      /* three a vertex */
  const float* normals;        /* NULL: not asked for */
  const float* velocities;     /* likewise; of the animation: see velocity_scale */
  const float* rest_positions; /* likewise; four a vertex */
  const uint32_t* triangles;   /* three vertices a triangle */
  float bounds_min[3];
  float bounds_max[3];
  double time_s;
  size_t num_weights;
  const double* weights; /* that were used */
  int64_t version;       /* of the family; 0: not known */
  int32_t level_of_detail;
  int32_t extrapolated; /* the parameters lie outside of the family's points */
  int32_t clamped;      /* other weights than asked for: a falling part would not fall */
  /* What velocities are to be multiplied by to be those of the screen: seconds of the animation per
   * second of the player's clock, 0 while it is paused. 1 of frames that no player plays. */
  double velocity_scale;
} lb_frame_info;

LB_API void lb_frame_describe(const lb_frame* frame, lb_frame_info* info);
/* A frame lives until it has been freed as often as it was given or retained; also longer than its
 * client or player. */
LB_API void lb_frame_retain(lb_frame* frame);
LB_API void lb_frame_free(lb_frame* frame);

/* Memory of the caller's, such as a mapped vertex buffer, and where in it things go. */
typedef struct lb_layout {
  size_t struct_size;
  void* vertices; /* vertex v begins at v * stride bytes */
  size_t vertices_size;
  size_t stride;
  /* Bytes from the vertex' beginning; negative: not wanted. Floats as in lb_frame_info, but
   * velocities, which are multiplied by velocity_scale. */
  int32_t position_offset;
  int32_t normal_offset;
  int32_t velocity_offset;
  int32_t rest_offset;
  void* indices; /* NULL: not wanted */
  size_t indices_size;
  int32_t index_bytes; /* 2 or 4; 0: 4 */
  int32_t reserved;
} lb_layout;

/* Copies the frame there.
 * Errors: LB_OUT_OF_RANGE if it does not fit, naming the bytes that it needs, or if 2 bytes do not
 * hold an index; LB_INVALID_ARGUMENT if the frame has no such attribute, or the layout overlaps. */
LB_API lb_status lb_frame_copy(const lb_frame* frame, const lb_layout* layout);

/* ---- streams */

/* Frames of a family at many times, one after the other, which a server sends ahead of what is read.
 * Threads: one thread at a time calls lb_stream_next(); lb_stream_cancel() is safe. */
typedef struct lb_stream lb_stream;

typedef struct lb_stream_request {
  size_t struct_size;
  const char* family;
  int64_t version; /* 0: the newest */
  size_t num_weights;
  const double* weights; /* one per target; of all frames */
  size_t num_parameters;
  const lb_parameter* parameters; /* instead of weights */
  int32_t extrapolate;            /* as of lb_frame_request */
  const lb_surface* surface;      /* NULL: the slice itself */
  double time_s;                  /* of the first frame; the next are rate / frames_per_second later */
  double rate;                    /* seconds of the animation per second; negative: backwards; 0: 1 */
  double frames_per_second;       /* 0: the family's */
  int32_t loop;                   /* 1: starts again at the end, and never ends by itself */
  int32_t live;          /* 0: every frame, as fast as they are made and read; 1: at their time of
                          * the server's clock, without those that would be late */
  int32_t adapts_detail; /* of a live one: coarser frames while the connection is too slow */
  int32_t reserved;
} lb_stream_request;

/* Opens a stream. It waits only while there is no connection, 5 s at most: errors of the server's
 * come with the first frame. It may outlive its client. */
LB_API lb_status lb_stream_open(lb_client* client, const lb_stream_request* request,
                                lb_stream** out);
/* Waits for the next frame. At the end it is LB_OK, and `out` is NULL.
 * If the server stops or is lost, it goes on at another one with the next frame.
 * Errors: the server's; LB_UNAVAILABLE if no server can be reached, LB_CANCELLED once it is
 * cancelled.
 * After one the stream has ended. */
LB_API lb_status lb_stream_next(lb_stream* stream, lb_frame** out);
/* Ends the stream at once; lb_stream_next() that waits in another thread returns. */
LB_API void lb_stream_cancel(lb_stream* stream);
/* Cancels it, and frees it. Frames stay. Not while another thread is in lb_stream_next(). */
LB_API void lb_stream_free(lb_stream* stream);

/* ---- players */

/* A family that plays: frames are got ahead, on threads of the player's, while weights, time and
 * rate change. Of a server, or of a family's file without any.
 * Threads: one thread at a time calls the functions of a player; lb_player_wait_exact() and
 * lb_player_statistics() are safe. */
typedef struct lb_player lb_player;

/* Way of frames to the player. */
typedef enum lb_transport {
  LB_TRANSPORT_AUTOMATIC = 0, /* the second; the third where the network is too slow */
  LB_TRANSPORT_MESHOPT = 1,   /* decodes fast */
  LB_TRANSPORT_DRACO = 2      /* has the fewest bytes */
} lb_transport;

typedef struct lb_player_options {
  size_t struct_size;
  const char* file;                  /* of a family (lb_client_download()), or ... */
  const lb_connect_options* connect; /* ... servers; NULL: the defaults. And ... */
  const char* family;                /* ... the family's id */
  int64_t version;                   /* 0: the published one; it stays the same while it plays */
  const lb_surface* surface;         /* NULL: the slice itself */
  double frames_per_second; /* of the screen; 0: 60 */
  double look_ahead_s;      /* how early frames are got; 0: 0.5; negative: none */
  int32_t num_threads;      /* 0: 4 */
  int32_t fixed_detail;     /* 1: never coarser than surface->level_of_detail, whatever is missed */
  lb_transport transport;
  const lb_allocator* allocator; /* of frames' memory; NULL: malloc */
  lb_log_function log;           /* NULL: none */
  void* log_user;
} lb_player_options;

/* Opens the family, paused at its beginning with weights 0. Waits for servers, or until the file is
 * read and indexed. */
LB_API lb_status lb_player_open(const lb_player_options* options, lb_player** out);
/* Waits for calls that are on their way, 5 s at most. Frames stay. */
LB_API void lb_player_free(lb_player* player);
LB_API void lb_player_describe(const lb_player* player, lb_family_info* info);

/* Changes, from the last poll on. They may wait for another thread, for microseconds. */
/*   over_s  how long the change takes: linearly from what it is now */
LB_API lb_status lb_player_set_weights(lb_player* player, size_t num_weights,
                                       const double* weights, double over_s);
LB_API lb_status lb_player_set_parameters(lb_player* player, size_t num_parameters,
                                          const lb_parameter* parameters, int32_t extrapolate,
                                          double over_s);
LB_API void lb_player_play(lb_player* player);
LB_API void lb_player_pause(lb_player* player);
LB_API void lb_player_set_loop(lb_player* player, int32_t loop);
/* Seconds of the animation per second; negative: backwards. */
LB_API lb_status lb_player_set_rate(lb_player* player, double rate);
LB_API lb_status lb_player_seek(lb_player* player, double time_s);

/* Returns the newest frame that is due, to be freed by the caller; NULL: none was there yet. While
 * that is the same as before, so is the handle. Never waits.
 *   now  the program's clock: seconds from any origin, never back */
LB_API lb_frame* lb_player_poll(lb_player* player, double now);

/* Waits for the frame of exactly this time and the weights that were set last, and no other: for
 * renders. Tries again while no server can be reached.
 * Errors: LB_DEADLINE_EXCEEDED after patience_s, and after the attempt that is on its way then. */
LB_API lb_status lb_player_wait_exact(lb_player* player, double time_s, double patience_s,
                                      lb_frame** out);

typedef struct lb_player_info {
  size_t struct_size;
  int64_t num_shown;     /* frames that became due and were there */
  int64_t num_missed;    /* moments of the screen that passed without one while it played */
  int64_t num_stale;     /* of the shown: with weights from before a change */
  int64_t num_received;  /* frames that were got */
  int64_t num_bytes;     /* received */
  double wait_ms;        /* a frame, on average: for the server ... */
  double decode_ms;      /* ... and decoding it, or making it of a file */
  double latency_ms;     /* from asking for a frame to having it, at present */
  int32_t level_of_detail;
  lb_transport transport;
  lb_status status;      /* of the newest failure; LB_OK since a frame has come */
} lb_player_info;

LB_API void lb_player_statistics(const lb_player* player, lb_player_info* info);

#ifdef __cplusplus
}
#endif

#endif /* LIQUIDBLEND_LIQUIDBLEND_H_ */
