# SPDX-License-Identifier: GPL-3.0-or-later
# Blender reads properties from annotations that are calls:
# mypy: disable-error-code="valid-type"
"""The operator that writes levels to a file, named and laid out for an engine."""

from pathlib import Path
from typing import TYPE_CHECKING

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty

from ..bridge import level_info
from ..core.errors import MeshError
from ..jobs.refusal import refuse
from ..settings.profiles import PROFILES
from .lod_polls import chosen_objects, why_not_update
from .polls import poll_with
from .reports import tell

if TYPE_CHECKING:
    from ..bridge.export_levels import LevelGroup

_PROFILES = (
    ("levels", "As Generated", "The profile that the levels were made for"),
    *((profile.key, profile.label, f"Names and layout for {profile.label}") for profile in PROFILES.values()),
)
_WHICH = (
    ("SELECTED", "Selected", "Levels of the selected objects, which may be sources or levels"),
    ("ALL", "All", "All levels in the file"),
)


class OBJECT_OT_eso_lod_export(bpy.types.Operator):
    """Write levels of detail to a file, named and laid out for an engine"""

    bl_idname = "object.eso_lod_export"
    bl_label = "ESO Export LODs"
    bl_options = {"REGISTER", "PRESET"}

    filepath: StringProperty(name="File", subtype="FILE_PATH", options={"SKIP_SAVE"})
    filter_glob: StringProperty(default="*.fbx;*.glb;*.gltf;*.obj;*.blend", options={"HIDDEN"})
    check_existing: BoolProperty(default=True, options={"HIDDEN"})
    profile: EnumProperty(name="Profile", items=_PROFILES, default="levels")
    which: EnumProperty(name="Of", items=_WHICH, default="SELECTED")

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Need levels."""
        return poll_with(cls, why_not_update(context))

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Ask for a file."""
        try:
            groups, key = self._groups(context)
        except MeshError as error:
            return refuse(self, error)
        if not self.filepath:
            folder = Path(bpy.data.filepath).parent if bpy.data.filepath else Path.home()
            name = bpy.path.clean_name(groups[0].base) if groups else "levels"
            self.filepath = str(folder / f"{name}{PROFILES[key].ending}")
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw the options beside the file browser."""
        self.layout.use_property_split = True
        self.layout.prop(self, "profile")
        self.layout.prop(self, "which")

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Write the file."""
        from ..bridge.export_levels import export_levels
        from ..bridge.scene_files import WRITERS, write_stage

        try:
            groups, key = self._groups(context)
            profile = PROFILES[key]
            path = self._path(profile.ending)
            ending = path.suffix.lower()
            export_levels(path, groups, profile.layout, write_stage if ending == ".blend" else WRITERS[ending])
        except (MeshError, OSError, RuntimeError) as error:
            return refuse(self, error)
        counts = {"object": len(groups), "level": sum(len(group.levels) for group in groups),
                  "hull": sum(len(group.hulls) for group in groups)}
        lines = [f"{count} {name}{'s' if count > 1 else ''}" for name, count in counts.items() if count]
        tell(self, context, f"Wrote {path.name} for {profile.label}", lines, self._stale_notes(context))
        return {"FINISHED"}

    def _path(self, ending: str) -> Path:
        from ..bridge.export_levels import ENDINGS

        if not self.filepath:
            raise MeshError("no file is named: give its path")
        path = Path(bpy.path.abspath(self.filepath))
        if not path.suffix:
            path = path.with_suffix(ending)
        if path.suffix.lower() not in ENDINGS:
            raise MeshError(f"'{path.name}' is of no format that holds levels: use one of {' '.join(ENDINGS)}")
        return path

    def _groups(self, context: bpy.types.Context) -> "tuple[list[LevelGroup], str]":
        """Gather what is to be written, and the profile's key."""
        from ..bridge.export_levels import groups_of

        families = self._families(context)
        if not families:
            raise MeshError("none of the selected objects has levels: generate some, or export all")
        keys = {str(level.get(level_info.PROFILE, "")) for family in families for level in family.levels}
        key = self.profile
        if key == "levels":
            if len(keys) > 1:
                raise MeshError("these levels were made for several profiles: choose one")
            key = next(iter(keys & set(PROFILES)), "plain")
        for family in families:
            if reason := PROFILES[key].why_not(len(family.levels)):
                raise MeshError(f"'{family.name}': {reason}")
        return groups_of(families, PROFILES[key].name, PROFILES[key].hull_name), key

    def _families(self, context: bpy.types.Context) -> list[level_info.Family]:
        from ..bridge.lod_sources import meshes_behind

        if self.which == "ALL":
            return level_info.families()
        return level_info.families(meshes_behind(chosen_objects(context)))

    def _stale_notes(self, context: bpy.types.Context) -> list[str]:
        stale = [family.name for family in self._families(context) if level_info.stale_ones(family.levels)]
        return [f"Edited since: {', '.join(stale)}; update the levels, then export again"] if stale else []


OPERATOR = OBJECT_OT_eso_lod_export
