#!/usr/bin/env python3
"""Generate liquid mesh sequences with Blender's Mantaflow FLIP solver, headless.

    blender -b --factory-startup --python tests/data/simulate.py -- SCENE NAME [--size small|large]
            [--res N] [--upres N] [--frames N] [--out DIR] [--root DIR] [--list]

One call bakes ONE animation into ROOT/SCENE_SIZE/NAME/ :
    fluid_mesh_####.bobj.gz   surface mesh            (untouched Mantaflow cache)
    lVelMesh_####.uni         velocity of each vertex (untouched Mantaflow cache, gzip inside)
    meta.json               units, parameters, timings
    scene.blend             (with --blend) the scene, domain pointing at the cache
All animations of one scene share domain, gravity, resolution and time step rules, so that only
the named parameters differ.  World units are metres and seconds.
"""
import sys, os, json, time, math, shutil, argparse

FPS = 24

# ---------------------------------------------------------------- scene descriptions
# Each scene: domain size (m), default frames, resolution per size, and variants.
# A variant is a dict of parameters; build_<scene>() turns it into objects.
SCENES = {
    'two_drops': dict(
        domain=(4.4, 2.4, 3.2), frames=72,
        size=dict(small=(56, 1), large=(84, 2)),
        common=dict(pool=0.70, radius=0.36, xl=-1.0, xr=1.0),
        variants={
            'A':   dict(zl=1.60, zr=2.70),
            'MID': dict(zl=2.15, zr=2.15),
            'B':   dict(zl=2.70, zr=1.60),
        }),
    'dam_break': dict(
        domain=(4.8, 1.6, 2.0), frames=72,
        size=dict(small=(72, 1), large=(96, 2)),
        common=dict(pool=0.30, block_len=1.1, block_h=1.25, wall_thick=0.30),
        variants={
            'w0_p0': dict(w=0.50, p=0.10), 'w1_p0': dict(w=1.10, p=0.10),
            'w0_p1': dict(w=0.50, p=1.10), 'w1_p1': dict(w=1.10, p=1.10),
            'wm_pm': dict(w=0.80, p=0.60), 'wm_p0': dict(w=0.80, p=0.10),
        }),
    'crown': dict(
        domain=(3.4, 3.4, 2.6), frames=60,
        size=dict(small=(56, 1), large=(80, 2)),
        common=dict(pool=0.24, z=1.6),
        variants={   # radius of the drop and its start velocity (m/s)
            'A':   dict(radius=0.26, v=-3.5),
            'MID': dict(radius=0.33, v=-4.75),
            'B':   dict(radius=0.40, v=-6.0),
        }),
    'throw': dict(
        domain=(4.4, 2.2, 2.6), frames=60,
        size=dict(small=(72, 1), large=(96, 2)),
        common=dict(pool=0.50, scale=0.48, x=-1.45, z=1.35, speed=3.4),
        variants={   # direction of the throw: elevation above the horizon, in degrees
            'A':   dict(elevation=10.0),
            'MID': dict(elevation=30.0),
            'B':   dict(elevation=50.0),
        }),
    'moved_drop': dict(
        domain=(4.4, 2.4, 3.2), frames=48,
        size=dict(small=(56, 1), large=(84, 2)),
        common=dict(pool=0.70, radius=0.36, z=2.0),
        variants={   # where the drop falls; nothing else differs
            'A':   dict(x=-0.70, y=-0.20),
            'MID': dict(x=0.05, y=0.025),
            'B':   dict(x=0.80, y=0.25),
        }),
}
# Scenes that nothing was tuned for. The middle of each has the means of A's and B's parameters.
SCENES.update({
    'far_drop': dict(
        domain=(4.4, 2.4, 3.2), frames=60,
        size=dict(small=(56, 1), large=(84, 2)),
        common=dict(pool=0.70, radius=0.34),
        variants={   # where the drop falls, and from where
            'A':   dict(x=-0.80, y=0.15, z=1.60),
            'MID': dict(x=0.00, y=0.00, z=2.10),
            'B':   dict(x=0.80, y=-0.15, z=2.60),
        }),
    'placed_drop': dict(
        domain=(4.4, 2.4, 3.2), frames=60,
        size=dict(small=(56, 1), large=(84, 2)),
        common=dict(pool=0.70, radius=0.36, y=0.0),
        variants={   # where the drop falls, and from where: corners of a parameter space
            'x0_z0': dict(x=-0.90, z=1.60), 'x1_z0': dict(x=0.90, z=1.60),
            'x0_z1': dict(x=-0.90, z=2.60), 'x1_z1': dict(x=0.90, z=2.60),
        }),
    'crossing_drops': dict(
        domain=(4.4, 2.4, 3.2), frames=48,
        size=dict(small=(56, 1), large=(84, 2)),
        common=dict(pool=0.70, large=0.40, small=0.26, ylarge=0.50, ysmall=-0.50, z=1.90),
        variants={   # the large and the small drop change sides
            'A':   dict(xlarge=-0.90, xsmall=0.90),
            'MID': dict(xlarge=0.00, xsmall=0.00),
            'B':   dict(xlarge=0.90, xsmall=-0.90),
        }),
    'drop_size': dict(
        domain=(4.4, 2.4, 3.2), frames=60,
        size=dict(small=(56, 1), large=(84, 2)),
        common=dict(pool=0.70, x=0.1, y=0.05, z=1.90),
        variants={   # radius of the drop
            'A':   dict(radius=0.26),
            'MID': dict(radius=0.35),
            'B':   dict(radius=0.44),
        }),
    'block_length': dict(
        domain=(4.8, 1.6, 2.0), frames=60,
        size=dict(small=(72, 1), large=(96, 2)),
        common=dict(pool=0.25, block_h=1.10),
        variants={   # length of the block that collapses
            'A':   dict(block_len=0.60),
            'MID': dict(block_len=1.00),
            'B':   dict(block_len=1.40),
        }),
    'inflow_start': dict(
        domain=(4.4, 2.4, 3.2), frames=60,
        size=dict(small=(56, 1), large=(84, 2)),
        common=dict(pool=0.60, radius=0.24, x=-0.9, z=2.0, speed=2.0),
        variants={   # frame in which a jet of liquid begins to flow in
            'A':   dict(start=4),
            'MID': dict(start=10),
            'B':   dict(start=16),
        }),
    'moving_obstacle': dict(
        domain=(4.8, 1.6, 2.0), frames=60,
        size=dict(small=(72, 1), large=(96, 2)),
        common=dict(pool=0.60, thick=0.30, width=0.90, x=-1.60),
        variants={   # speed at which a block is pushed through the pool, m/s
            'A':   dict(speed=0.60),
            'MID': dict(speed=0.90),
            'B':   dict(speed=1.20),
        }),
})
SCENES['touching_drops'] = dict(
    SCENES['two_drops'], variants={   # where the drops begin: in A both touch the pool
        'A':   dict(zl=1.30, zr=1.30),
        'MID': dict(zl=1.95, zr=1.65),
        'B':   dict(zl=2.60, zr=2.00),
    })
# Elevations between those of A, MID and B.
SCENES['throw']['variants'].update({'at_20': dict(elevation=20.0), 'at_40': dict(elevation=40.0)})
# The inputs of two_drops_bridged: the lower drop touches the pool in the first frame.
SCENES['two_drops']['variants'].update({
    'bridged_A':   dict(zl=1.30, zr=2.60),
    'bridged_MID': dict(zl=1.95, zr=1.95),
    'bridged_B':   dict(zl=2.60, zr=1.30),
})


def parse(argv):
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    ap.add_argument('scene', choices=sorted(SCENES))
    ap.add_argument('name')
    ap.add_argument('--size', default='small', help='small or large: picks resolution, names the folder')
    ap.add_argument('--res', type=int, help='override: voxels along the longest domain side')
    ap.add_argument('--upres', type=int, help='override: mesh upres factor (domain.mesh_scale)')
    ap.add_argument('--frames', type=int)
    ap.add_argument('--root', default='simulations')
    ap.add_argument('--out', help='override the output folder')
    ap.add_argument('--no-velocity', action='store_true')
    ap.add_argument('--blend', action='store_true', help='also keep scene.blend')
    ap.add_argument('--keep-cache', action='store_true', help='keep the FLIP particle/grid cache too')
    a = ap.parse_args(argv)
    if a.name not in SCENES[a.scene]['variants']:
        ap.error('names of %s: %s' % (a.scene, ' '.join(SCENES[a.scene]['variants'])))
    return a


# ---------------------------------------------------------------- Blender helpers
def box(bpy, name, lo, hi):
    """Axis-aligned box from corner lo to corner hi, transform left at identity."""
    me = bpy.data.meshes.new(name)
    v = [(x, y, z) for z in (lo[2], hi[2]) for y in (lo[1], hi[1]) for x in (lo[0], hi[0])]
    f = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    me.from_pydata(v, [], f)
    me.update()
    ob = bpy.data.objects.new(name, me)
    bpy.context.scene.collection.objects.link(ob)
    return ob


def sphere(bpy, name, centre, radius):
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4, radius=radius, location=centre)
    ob = bpy.context.object
    ob.name = name
    return ob


def liquid(ob, velocity=None):
    """Make ob a liquid that exists at the first frame (flow behaviour GEOMETRY)."""
    m = ob.modifiers.new('Fluid', 'FLUID')
    m.fluid_type = 'FLOW'
    f = m.flow_settings
    f.flow_type = 'LIQUID'
    f.flow_behavior = 'GEOMETRY'
    f.surface_distance = 0.0          # default 1.5 voxels would inflate the shape
    if velocity is not None:
        f.use_initial_velocity = True
        f.velocity_factor = 0.0       # no velocity from object motion
        f.velocity_normal = 0.0
        f.velocity_coord = velocity
    return ob


def obstacle(ob):
    m = ob.modifiers.new('Fluid', 'FLUID')
    m.fluid_type = 'EFFECTOR'
    e = m.effector_settings
    e.effector_type = 'COLLISION'
    e.surface_distance = 0.0
    return ob


# ---------------------------------------------------------------- the scenes
def floor_pool(bpy, dom, depth):
    sx, sy, sz = dom
    e = 0.5                            # reach beyond the domain, so that the pool touches every wall
    return liquid(box(bpy, 'pool', (-sx / 2 - e, -sy / 2 - e, -sz / 2 - e), (sx / 2 + e, sy / 2 + e, -sz / 2 + depth)))


def build_two_drops(bpy, dom, p):
    floor_pool(bpy, dom, p['pool'])
    z0 = -dom[2] / 2                   # heights are given above the domain's floor
    liquid(sphere(bpy, 'left', (p['xl'], 0, z0 + p['zl']), p['radius']))
    liquid(sphere(bpy, 'right', (p['xr'], 0, z0 + p['zr']), p['radius']))


def build_moved_drop(bpy, dom, p):
    floor_pool(bpy, dom, p['pool'])
    liquid(sphere(bpy, 'drop', (p['x'], p['y'], -dom[2] / 2 + p['z']), p['radius']))


def build_block_length(bpy, dom, p):
    sx, sy, sz = dom
    e = 0.5
    floor_pool(bpy, dom, p['pool'])
    liquid(box(bpy, 'block', (-sx / 2 - e, -sy / 2 - e, -sz / 2 - e),
               (-sx / 2 + p['block_len'], sy / 2 + e, -sz / 2 + p['block_h'])))


def build_dam_break(bpy, dom, p):
    build_block_length(bpy, dom, p)
    sx, sy, sz = dom
    e = 0.5
    # wall: from the side y=-sy/2, w wide across the channel, centred at x=p, full height
    obstacle(box(bpy, 'wall', (p['p'] - p['wall_thick'] / 2, -sy / 2 - e, -sz / 2 - e),
                 (p['p'] + p['wall_thick'] / 2, -sy / 2 + p['w'], sz / 2 + e)))


def build_crown(bpy, dom, p):
    floor_pool(bpy, dom, p['pool'])
    liquid(sphere(bpy, 'drop', (0, 0, -dom[2] / 2 + p['z']), p['radius']), velocity=(0, 0, p['v']))


def build_throw(bpy, dom, p):
    floor_pool(bpy, dom, p['pool'])
    bpy.ops.mesh.primitive_monkey_add(size=2, location=(p['x'], 0, -dom[2] / 2 + p['z']),
                                      rotation=(0, 0, math.radians(90)))
    ob = bpy.context.object
    ob.scale = (p['scale'],) * 3
    a = math.radians(p['elevation'])
    liquid(ob, velocity=(p['speed'] * math.cos(a), 0, p['speed'] * math.sin(a)))


build_far_drop = build_placed_drop = build_drop_size = build_moved_drop
build_touching_drops = build_two_drops


def build_crossing_drops(bpy, dom, p):
    floor_pool(bpy, dom, p['pool'])
    z = -dom[2] / 2 + p['z']
    liquid(sphere(bpy, 'large', (p['xlarge'], p['ylarge'], z), p['large']))
    liquid(sphere(bpy, 'small', (p['xsmall'], p['ysmall'], z), p['small']))


def build_inflow_start(bpy, dom, p):
    floor_pool(bpy, dom, p['pool'])
    ob = sphere(bpy, 'jet', (p['x'], 0, -dom[2] / 2 + p['z']), p['radius'])
    f = liquid(ob, velocity=(p['speed'], 0, 0)).modifiers['Fluid'].flow_settings
    f.flow_behavior = 'INFLOW'
    f.use_inflow = False
    f.keyframe_insert('use_inflow', frame=1)
    f.use_inflow = True
    f.keyframe_insert('use_inflow', frame=p['start'])


def build_moving_obstacle(bpy, dom, p):
    floor_pool(bpy, dom, p['pool'])
    z = -dom[2] / 2
    ob = box(bpy, 'paddle', (p['x'] - p['thick'] / 2, -p['width'] / 2, z - 0.5),
             (p['x'] + p['thick'] / 2, p['width'] / 2, z + dom[2] * 0.75))
    obstacle(ob)
    frames = SCENES['moving_obstacle']['frames']
    for frame in (1, frames):
        ob.location = (p['speed'] * (frame - 1) / FPS, 0, 0)
        ob.keyframe_insert('location', frame=frame)
    for curve in ob.animation_data.action.fcurves:
        for point in curve.keyframe_points:
            point.interpolation = 'LINEAR'


# ---------------------------------------------------------------- bake
def main():
    a = parse(sys.argv[sys.argv.index('--') + 1:] if '--' in sys.argv else sys.argv[1:])
    import bpy
    S = SCENES[a.scene]
    dom = S['domain']
    res, upres = S['size'].get(a.size, S['size']['small'])
    res, upres = a.res or res, a.upres or upres
    frames = a.frames or S['frames']
    params = dict(S['common'], **S['variants'][a.name])
    out = a.out or os.path.join(a.root, '%s_%s' % (a.scene, a.size), a.name)
    cache = os.path.join(out, '_cache')
    shutil.rmtree(cache, ignore_errors=True)
    os.makedirs(cache)

    bpy.ops.wm.read_factory_settings(use_empty=True)
    sc = bpy.context.scene
    sc.render.fps = FPS
    sc.frame_start, sc.frame_end = 1, frames
    sc.gravity = (0, 0, -9.81)

    d = box(bpy, 'domain', tuple(-s / 2 for s in dom), tuple(s / 2 for s in dom))
    m = d.modifiers.new('Fluid', 'FLUID')
    m.fluid_type = 'DOMAIN'
    s = m.domain_settings
    s.domain_type = 'LIQUID'
    s.resolution_max = res
    s.time_scale = 1.0
    s.use_adaptive_timesteps = True
    s.cfl_condition = 2.0
    s.timesteps_min, s.timesteps_max = 2, 8
    s.simulation_method = 'FLIP'
    s.flip_ratio = 0.95
    s.particle_radius = 1.0
    s.particle_number = 2              # 2^3 particles per cell
    s.particle_randomness = 0.1
    s.particle_min, s.particle_max = 8, 16
    s.particle_band_width = 3.0
    s.use_fractions = False
    s.use_mesh = True
    s.mesh_scale = upres
    s.mesh_generator = 'IMPROVED'
    s.mesh_particle_radius = 2.0
    s.mesh_smoothen_pos, s.mesh_smoothen_neg = 1, 1
    s.mesh_concave_upper, s.mesh_concave_lower = 3.5, 0.4
    s.use_speed_vectors = not a.no_velocity
    s.cache_type = 'ALL'
    s.cache_frame_start, s.cache_frame_end = 1, frames
    s.cache_data_format = 'UNI'        # with OPENVDB no per-vertex velocity file is written
    s.cache_mesh_format = 'BOBJECT'
    s.cache_directory = cache          # set last: changing other settings can reset the cache

    globals()['build_' + a.scene](bpy, dom, params)

    bpy.context.view_layer.objects.active = d
    d.select_set(True)
    t0, c0 = time.time(), os.times()
    with bpy.context.temp_override(object=d, active_object=d, selected_objects=[d]):
        r = bpy.ops.fluid.bake_all()   # EXEC in background: blocks until done
    wall = time.time() - t0
    cpu = sum(os.times()[:2]) - sum(c0[:2])
    print('BAKE', r, 'wall %.1f s' % wall, flush=True)

    # move the mesh cache up, untouched
    n = 0
    src = os.path.join(cache, 'mesh')
    for f in sorted(os.listdir(src)):
        os.replace(os.path.join(src, f), os.path.join(out, f))
        n += 1
    # per-frame cost from the write times of the cache files
    stamps = sorted(os.path.getmtime(os.path.join(out, f)) for f in os.listdir(out) if f.startswith('fluid_mesh_'))
    dx = max(dom) / res
    L = max(dom)
    units = dict(
        world='metres, seconds; z up; domain centred on the origin',
        vertices='file position p is in the unit cube centred on 0: world = p * %g (longest domain side)' % L,
        velocities='file velocity u is in simulation cells (not mesh cells) per Mantaflow time unit, and 1 s = 2.5 units '
                   'whatever the fps: m/s = u * voxel_size_m * 2.5; m/frame = u * voxel_size_m * 2.5 / fps',
        vertex_scale=L, velocity_scale_to_m_per_s=dx * 2.5, velocity_scale_to_m_per_frame=dx * 2.5 / FPS,
        frame_1='positions as set up; its velocities already hold the first gravity kick')
    grid = [int(round(x / dx)) for x in dom]
    meta = dict(
        scene=a.scene, name=a.name, size=a.size, blender=bpy.app.version_string,
        fps=FPS, frame_range=[1, frames], params=params, gravity=list(sc.gravity),
        domain_size_m=dom, domain_centre_m=[0, 0, 0], resolution_max=res, grid=grid,
        voxel_size_m=dx, mesh_upres=upres, mesh_voxel_size_m=dx / upres,
        units=units,
        settings={k: getattr(s, k) for k in
                  ('simulation_method', 'flip_ratio', 'particle_radius', 'particle_number', 'particle_randomness',
                   'particle_band_width', 'cfl_condition', 'timesteps_min', 'timesteps_max', 'use_adaptive_timesteps',
                   'use_fractions', 'mesh_generator', 'mesh_particle_radius', 'mesh_smoothen_pos', 'mesh_smoothen_neg',
                   'mesh_concave_upper', 'mesh_concave_lower', 'cache_data_format', 'cache_mesh_format')},
        seconds_bake_total=round(wall, 2), cpu_seconds_bake_total=round(cpu, 2), cpu_seconds_per_frame=round(cpu / frames, 3), seconds_per_frame=round(wall / frames, 3),
        seconds_between_first_and_last_frame=round(stamps[-1] - stamps[0], 2) if stamps else None,
    )
    json.dump(meta, open(os.path.join(out, 'meta.json'), 'w'), indent=1)
    if a.keep_cache or a.blend:
        for f in os.listdir(out):
            if f.endswith(('.gz', '.uni')):
                os.link(os.path.join(out, f), os.path.join(src, f))
    if a.blend:
        bpy.ops.wm.save_as_mainfile(filepath=os.path.join(out, 'scene.blend'))
    elif not a.keep_cache:
        shutil.rmtree(cache)
    print('DONE', a.scene, a.name, a.size, n, 'files', '%.2f s/frame' % (wall / frames), flush=True)


main()
